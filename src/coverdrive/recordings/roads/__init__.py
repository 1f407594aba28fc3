"""Lanes of a map, or the places where vehicles drive, go in; out comes the road that they drive on.

Door: `drawn_road`, `driven_road` and `border`. The rest is for recordings alone.
"""
