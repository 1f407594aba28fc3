"""Settings or recordings go in; out come a road, and where on it a trial begins (paper §5).

Door: all of it; `places` has the roads of a name.
"""
