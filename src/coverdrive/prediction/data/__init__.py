"""Recordings go in; out come segments of three seconds, on sides of a split that share no vehicle (paper §2.1, §3.2).

Door: `segments`, `split`, `manoeuvres` and `held_out`.
"""
