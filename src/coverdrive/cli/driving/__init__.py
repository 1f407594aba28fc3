"""Commands that drive.

Door: all of it; commands are loaded by name.
"""
