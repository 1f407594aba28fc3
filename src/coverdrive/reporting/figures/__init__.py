"""Results go in; out come figures, one file for each result.

Door: `gallery`, which has all of a report; `affordance`, `risk`, `recording`, `league` and `frontier`.
"""
