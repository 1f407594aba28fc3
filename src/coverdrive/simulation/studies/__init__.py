"""Who drives where, and a seed, go in; out come many trials, in a folder from which they go on (paper §5).

Door: `study`, `comparison`, `setup`, `folder`, `workers`, `driven_on` and `ahead`.
"""
