"""One look, without any trace in matplotlib's global state, and the same on the page."""

import re
from importlib.resources import files

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from coverdrive.reporting.plotting import style

pytestmark = pytest.mark.usefixtures("no_global_change")


def test_style_ends_with_its_context():
    before = mpl.rcParams["axes.spines.top"]
    with style.style():
        assert mpl.rcParams["axes.spines.top"] is False
    assert mpl.rcParams["axes.spines.top"] == before


def test_own_and_other_differ_in_brightness_on_grey_paper():
    luminance = [np.dot(to_rgb(colour), [0.2126, 0.7152, 0.0722]) for colour in (style.EGO, style.OTHER, style.ROAD)]
    assert luminance[0] < luminance[1] < luminance[2]


def test_page_and_figures_tell_how_plans_were_found_by_the_same_colours():
    css = (files("coverdrive.reporting.page") / "templates" / "page.css").read_text(encoding="utf-8")
    light = css[: css.index('[data-theme="dark"]')]
    for status, colour in style.STATUS.items():
        assert f"--{status.value.replace(' ', '-')}: {colour.lower()};" in light


def test_page_and_figures_have_the_hues_of_the_same_times():
    css = (files("coverdrive.reporting.page") / "templates" / "page.css").read_text(encoding="utf-8")
    light = css[: css.index('[data-theme="dark"]')]
    for name, colours in (("set", style.SETS), ("time", style.TIMES)):
        for when, age in (("now", 0.0), ("mid", 0.5), ("late", 1.0)):
            found = re.search(rf"--{name}-{when}: (\d+),(\d+),(\d+);", light)
            assert np.array(found.groups(), dtype=int) == pytest.approx(255 * np.array(colours(age)[:3]), abs=2)
