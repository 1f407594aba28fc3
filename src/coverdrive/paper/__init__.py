"""What only repeats the paper: its settings go in, out come its Tables 1 and 2 with ours beside them.

Door: all of it.
"""
