"""Lets the tests of this folder import the fakes of this one and of `simulation` and `recordings`."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[i] / name) for i, name in ((0, ""), (1, "simulation"), (1, "recordings"))]
