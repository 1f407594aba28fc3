"""Motions go in; out comes what they are worth: whether they are clear at any time, and their price; compiled.

Door: all of it; `evaluate` is the exact judge, `merit` the smooth one that the search makes small.
"""
