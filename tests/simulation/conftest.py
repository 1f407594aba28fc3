"""Lets the tests of this folder import `simulation_fakes`, which worker processes must be able to import too."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "reporting")]
