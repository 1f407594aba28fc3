"""Results go in; out come tables for terminals of any width.

Door: all of it; `fitting` keeps words and numbers whole.
"""
