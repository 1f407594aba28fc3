"""Marks on axes go in; out come pictures in files and pages, all in one style.

Door: all of it.
"""
