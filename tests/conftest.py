"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def us101() -> Path:
    """The folder of recorded US-101 traffic; tests that need it are skipped where it is missing."""
    folder = Path(os.environ.get("COVERDRIVE_DATA", Path(__file__).parents[2] / "shared" / "data")) / "us101"
    if not folder.is_dir():
        pytest.skip(f"the recorded US-101 traffic is not at {folder}; set COVERDRIVE_DATA to its parent folder")
    return folder
