"""Commands that show what was found before.

Door: all of it; commands are loaded by name.
"""
