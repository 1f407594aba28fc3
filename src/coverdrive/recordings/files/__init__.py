"""A file of a kind (delimited text, Parquet, CommonRoad, Lanelet2) goes in; out come its columns or lanes, checked.

Door: `boundary`, which names the file in every error, and `scenario`. The rest is for recordings alone.
"""
