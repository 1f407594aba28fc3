"""Lets the tests of this folder import the fakes of the simulation, of drawn planning problems and of recordings."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("simulation", "driving", "recordings")]
