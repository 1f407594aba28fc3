"""Lets the tests of this folder import `simulation_fakes`, which worker processes must be able to import too."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "simulation"))
