"""A file of a known data set goes in; out come recordings, or tracks in map coordinates that become some.

Door: `registry`, where a format is one line; `reader`, which says what a reader is; `commonroad` and `parquet`.
"""
