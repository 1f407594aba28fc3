"""A finished fit goes in; out come its calibrations side by side, its folds, and what is kept of it.

Door: all of it, for what stands above `prediction`.
"""
