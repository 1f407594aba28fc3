"""Segments go in; out comes the trajectory basis, an ε-cover of them, and how small any could be (paper §2.1).

Door: `basis`, `basis_study` and `motion`, which puts a base trajectory on a vehicle (Remark 1).
"""
