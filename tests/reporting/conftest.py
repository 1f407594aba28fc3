"""Fixtures of the report's tests, which find `report_fakes` beside this file, and the stand-ins of the simulation."""

import sys
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import _pylab_helpers

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "simulation")]


@pytest.fixture
def trace():
    from report_fakes import make_trace

    return make_trace()


@pytest.fixture
def no_global_change():
    """Fails a test that leaves a pyplot figure open or a matplotlib setting changed."""
    before = dict(mpl.rcParams)
    yield
    assert dict(mpl.rcParams) == before
    assert not _pylab_helpers.Gcf.figs
