"""A road goes in; out come people who drive on it by IDM and MOBIL, and recordings of them.

Door: `idm_mobil`, `freeway` and `generated`.
"""
