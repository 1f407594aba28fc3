"""What every command asks for and shows: options, progress, the terminal, and how a command ends.

Door: `options`, `bars`, `terminal` and `edge`.
"""
