"""Tests of one traffic that others take as theirs."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
