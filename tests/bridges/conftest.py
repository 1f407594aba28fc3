"""Lets the tests of this folder import the fakes of other folders."""

import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / "driving"), str(TESTS / "simulation")]
