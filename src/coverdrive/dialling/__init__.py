"""How bold may the ego be: risk proved on drives, the frontier of risk and speed, rare events."""
