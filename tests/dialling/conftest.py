"""Lets the tests of this folder import the stand-ins of the simulation's tests, and the toys here."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "simulation")]
