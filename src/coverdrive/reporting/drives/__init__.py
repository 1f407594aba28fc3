"""The trace of a drive goes in; out come pictures and a video of it, and in words what happened and why.

Door: `snapshots`, `animation`, `active_constraints`, `reasons` and `worst_moment`.
"""
