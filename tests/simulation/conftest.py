"""Lets the tests of this folder import `simulation_fakes`, which worker processes must find too, and `report_fakes`."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "reporting")]
