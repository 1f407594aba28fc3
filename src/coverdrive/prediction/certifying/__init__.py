"""A trained predictor and vehicles that did not train it go in; out come its rule, its certificate, and how it did.

Door: `calibrate`, `scored` and `occupied`.
"""
