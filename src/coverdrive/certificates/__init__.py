"""How often a predicted set misses, with proof (paper §3.2 and appendix). Sees arrays of scores, never cars."""
