"""The report of a results folder as one HTML page that needs nothing else."""
