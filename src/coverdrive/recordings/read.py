"""Reads recordings of any known kind, and puts those into one group that show the same vehicles."""

BLOCK = 60.0
"""[s] a long recording is cut into groups of this length"""

LONG = 120.0
"""[s] recordings that last longer are cut into groups"""
