"""Commands from recordings to a certified predictor.

Door: all of it; commands are loaded by name.
"""
