"""Recordings go in; out comes a certified predictor: the set of manoeuvres every vehicle may do next (paper §2, §3).

`fit` goes through the rooms from top to bottom: data, cover, learning or boxes, certifying. Door: `fit`, `predictor`,
`adaptive`, `stored`, `inside`.
"""
