"""Surroundings and guesses go in; out comes the best motion that was found in the given time; compiled.

Door: `search` and `manoeuvres`.
"""
