"""Worlds that others wrote, in which our driver drives: each needs an extra of the installation."""
