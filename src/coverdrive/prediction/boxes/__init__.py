"""Segments and affordances go in; out come boxes around every vehicle and moment, whose place and size are learned.

Door: none; `predictor` is for prediction alone, whose own `coverdrive.prediction.predictor` others ask.
"""
