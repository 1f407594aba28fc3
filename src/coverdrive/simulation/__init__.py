"""A predictor, a planner and a traffic go in; out come drives, and many of them as a study (paper §5).

Door: `studies.study`, above measures, drives, traffic, drivers and roads; `predictor` says what is asked of yours.
"""
