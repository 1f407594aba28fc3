"""The trace of a drive goes in; out come numbers: distances, windows that vehicles left, and rates of many trials.

Door: all of it; a row of a study is `trial`.
"""
