"""Figures become a PNG and a PDF, without any trace in matplotlib's global state."""

import re
import struct
from importlib.resources import files

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from coverdrive.report import style

pytestmark = pytest.mark.usefixtures("no_global_change")


def drawn():
    with style.style():
        figure = style.new_figure(4, 3)
        figure.subplots().set(xlabel="distance [m]", title="ε = 0.5")
    return figure


def test_save_writes_png_of_150_dpi_and_pdf(tmp_path):
    png, pdf = style.save(drawn(), tmp_path / "new folder" / "drive 0.5")
    assert [png.name, pdf.name] == ["drive 0.5.png", "drive 0.5.pdf"]
    header = png.read_bytes()[:24]
    assert header.startswith(b"\x89PNG\r\n\x1a\n")
    assert struct.unpack(">II", header[16:24]) == (600, 450)
    assert pdf.read_bytes().startswith(b"%PDF-")
    assert sorted(file.name for file in png.parent.iterdir()) == ["drive 0.5.pdf", "drive 0.5.png"]


def test_fonts_are_embedded_as_truetype(tmp_path):
    _, pdf = style.save(drawn(), tmp_path / "figure")
    content = pdf.read_bytes()
    assert re.search(rb"/FontFile2\b", content)
    assert not re.search(rb"/Subtype\s*/Type3\b", content)


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    first, second = (style.save(drawn(), tmp_path / name) for name in ("first", "second"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]


def test_a_failed_save_leaves_nothing_behind(tmp_path):
    figure = drawn()
    figure.axes[0].set_title(r"$\undefined$")
    with pytest.raises(ValueError, match="undefined"):
        style.save(figure, tmp_path / "figure")
    assert list(tmp_path.iterdir()) == []


def test_style_ends_with_its_context():
    before = mpl.rcParams["axes.spines.top"]
    with style.style():
        assert mpl.rcParams["axes.spines.top"] is False
    assert mpl.rcParams["axes.spines.top"] == before


def test_own_and_other_differ_in_brightness_on_grey_paper():
    luminance = [np.dot(to_rgb(colour), [0.2126, 0.7152, 0.0722]) for colour in (style.OWN, style.OTHER, style.ROAD)]
    assert luminance[0] < luminance[1] < luminance[2]


def test_page_and_figures_tell_how_plans_were_found_by_the_same_colours():
    css = (files("coverdrive.report.page") / "templates" / "page.css").read_text(encoding="utf-8")
    light = css[: css.index('[data-theme="dark"]')]
    for status, colour in style.STATUS.items():
        assert f"--{status.value}: {colour.lower()};" in light
