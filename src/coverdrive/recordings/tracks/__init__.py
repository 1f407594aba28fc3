"""Raw positions of vehicles go in; out come tracks: repaired, smoothed, filtered, and told apart across recordings.

Door: all of it, `reading` first.
"""
