"""From recordings to the set of manoeuvres that every vehicle may do next (paper §2 and §3.1)."""
