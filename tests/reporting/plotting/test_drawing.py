"""Figures are drawn as they are specified, and become a PNG and a PDF."""

import re
import struct

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import same_color

from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.drawing import draw, save
from coverdrive.reporting.plotting.figure import Axis, Band, Bars, Figure, Line, Panel, Points, Rule, Shapes, Texts

pytestmark = pytest.mark.usefixtures("no_global_change")

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def everything() -> Figure:
    marks = [
        Line(x=[0, 1, 2], y=[1, 2, 4], name="curve", dashed=True),
        Points(x=[1.0], y=[2.0], low=[1.0], high=[3.0], colour=style.GREEN, name="points", hover=["one"]),
        Bars(x=[0, 1], height=[2.0, 1.0], base=1.0, width=0.5),
        Band(x=[0, 1], low=[0, 0], high=[1, 2]),
        Shapes(outlines=[SQUARE], name="shape"),
        Texts(x=[1], y=[1], text=["word"]),
        Rule(at=5.0, axis="y"),
    ]
    return Figure(
        [[Panel(marks, Axis("time [s]"), Axis("way [m]", low=0), "title")], [Panel([], Axis(""), Axis(""))]], 3.0
    )


def test_every_mark_is_drawn_where_it_is_specified():
    axes, empty = draw(everything()).axes
    assert [line.get_xydata().tolist() for line in axes.lines[:2]] == [[[0, 1], [1, 2], [2, 4]], [[1, 2]]]
    assert axes.collections[0].get_segments()[0].tolist() == [[1, 1], [1, 3]]
    assert [(bar.get_x(), bar.get_y(), bar.get_height()) for bar in axes.patches] == [(-0.25, 1, 2), (0.75, 1, 1)]
    assert axes.collections[-1].get_paths()[0].vertices[:4].tolist() == SQUARE.tolist()
    assert [text.get_text() for text in axes.texts] == ["word"]
    assert axes.lines[-1].get_ydata()[0] == 5.0
    assert same_color(axes.lines[1].get_color(), style.GREEN)
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title(loc="left")) == ("time [s]", "way [m]", "title")
    assert not empty.lines


def test_points_of_which_there_are_none_take_no_room():
    curve, none = Line(x=[1, 10], y=[1, 10]), Points(x=[], y=[], low=[], high=[])

    def places(*marks):
        drawn = draw(Figure([[Panel([*marks], Axis("x", log=True), Axis("y", log=True))] * 2], 3.0))
        FigureCanvasAgg(drawn).draw()
        return [axes.get_position().bounds for axes in drawn.axes]

    assert places(curve, none) == places(curve)


def test_limits_ticks_and_legend_are_those_of_the_specification():
    figure = everything()
    drawn = draw(figure)
    for axes, panel in zip(drawn.axes, figure.panels, strict=True):
        x, y = panel.scales
        assert axes.get_xlim() == (x.low, x.high) and axes.get_ylim() == (y.low, y.high)
        assert [text.get_text() for text in axes.get_xticklabels()] == [text for _, text in x.ticks]
    (legend,) = drawn.subfigs[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["curve", "points", "shape"] == list(figure.named)


@pytest.mark.parametrize(("letters", "columns"), [(5, 4), (38, 2), (90, 1)])
def test_a_legend_has_as_many_columns_as_its_names_leave_room_for(letters, columns):
    points = [Points(x=[k], y=[k], name=str(k) * letters) for k in range(5)]
    drawn = draw(Figure([[Panel(points, Axis(""), Axis(""))]], 3.0, legend_columns=4))
    FigureCanvasAgg(drawn).draw()
    (legend,) = drawn.subfigs[0].legends
    place = legend.get_window_extent()
    assert legend._ncols == columns and place.x0 >= 0 and place.x1 <= drawn.bbox.x1


def test_files_are_as_wide_as_both_columns_of_a_paper(tmp_path):
    png, _ = save(everything(), tmp_path / "figure")
    assert struct.unpack(">I", png.read_bytes()[16:20]) == (round(7.16 * style.DPI),)


def of_matplotlib():
    with style.style():
        figure = style.new_figure(4, 3)
        figure.subplots().set(xlabel="distance [m]", title="ε = 0.5")
    return figure


def test_save_writes_png_of_200_dpi_and_pdf(tmp_path):
    png, pdf = save(of_matplotlib(), tmp_path / "new folder" / "drive 0.5")
    assert [png.name, pdf.name] == ["drive 0.5.png", "drive 0.5.pdf"]
    header = png.read_bytes()[:24]
    assert header.startswith(b"\x89PNG\r\n\x1a\n")
    assert struct.unpack(">II", header[16:24]) == (800, 600)
    assert pdf.read_bytes().startswith(b"%PDF-")
    assert sorted(file.name for file in png.parent.iterdir()) == ["drive 0.5.pdf", "drive 0.5.png"]


def test_fonts_are_embedded_as_truetype(tmp_path):
    _, pdf = save(of_matplotlib(), tmp_path / "figure")
    content = pdf.read_bytes()
    assert re.search(rb"/FontFile2\b", content)
    assert not re.search(rb"/Subtype\s*/Type3\b", content)


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    first, second = (save(of_matplotlib(), tmp_path / name) for name in ("first", "second"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]


def test_a_failed_save_leaves_nothing_behind(tmp_path):
    figure = of_matplotlib()
    figure.axes[0].set_title(r"$\undefined$")
    with pytest.raises(ValueError, match="undefined"):
        save(figure, tmp_path / "figure")
    assert list(tmp_path.iterdir()) == []
