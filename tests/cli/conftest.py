"""Lets the tests of this folder import drawn planning problems and recordings."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("driving", "recordings")]
