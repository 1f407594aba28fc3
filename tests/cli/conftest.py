"""Lets the tests of this folder import drawn planning problems, recordings and stand-ins of the simulation."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("driving", "recordings", "simulation")]
