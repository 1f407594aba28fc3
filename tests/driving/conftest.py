"""Lets the tests of this folder import the fakes of this one and of `simulation` and `recordings`."""

import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parents[i] / name) for i, name in ((0, ""), (1, "simulation"), (1, "recordings"))]


@pytest.fixture
def unjudged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the drivability checker, which takes longer than a drive, where `test_planning_problems` has it."""
    from coverdrive.driving import solved

    monkeypatch.setattr(solved, "refusal", lambda _: None)
