"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

_CHECKER = "beartype.beartype(conf=beartype.BeartypeConf(is_pep484_tower=True))"
"""Shapes are types, which the tests check; an int is good for a float."""

install_import_hook("coverdrive", _CHECKER)
settings.register_profile("coverdrive", deadline=None)  # a first call compiles
settings.load_profile("coverdrive")


@pytest.fixture(scope="session")
def us101() -> Path:
    """The folder of recorded US-101 traffic; where nobody says that it is there, tests that need it are skipped."""
    named = os.environ.get("COVERDRIVE_DATA")
    if named is None:
        pytest.skip("needs recorded US-101 traffic; set COVERDRIVE_DATA to the folder that holds us101/")
    folder = Path(named) / "us101"
    if not folder.is_dir():
        pytest.fail(f"COVERDRIVE_DATA is {named}, but there is no folder us101 in it")
    return folder
