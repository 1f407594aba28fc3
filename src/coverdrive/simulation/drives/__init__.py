"""A predictor, a planner and a traffic go in; out come the trace of one drive and how it ended (paper §5).

Door: all of it, `episode` first.
"""
