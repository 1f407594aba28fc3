"""Readers of recorded highway traffic (NGSIM, CommonRoad, own Parquet) and a generator of such traffic."""
