"""Settings, a road and predicted paths go in; out come the numbers of the optimal control problem (paper §4).

Door: all of it; compiled code takes the settings as `constants`.
"""
