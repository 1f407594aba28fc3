"""The lines on roads whose lanes begin and end, and on drawings of them."""

import jax
import numpy as np
import pytest
from report_fakes import make_trace

from coverdrive.reference_line import ReferenceLine
from coverdrive.reporting.drives.road_drawing import VERGE, RoadDrawing
from coverdrive.reporting.drives.road_markings import across, ahead_label, drawn_edges, markings
from coverdrive.reporting.drives.snapshots import snapshots
from coverdrive.reporting.plotting import style
from coverdrive.road import Road
from ramp_road import RAMP


def test_edges_are_drawn_where_there_are_lanes_on_both_sides():
    drawn = drawn_edges(RAMP, np.array([50.0, 105.0, 150.0, 235.0, 290.0]))
    assert drawn[:, [0, 3]].all() and drawn[:, 2].all()
    assert drawn[:, 1].tolist() == [False, False, True, False, False]
    assert drawn_edges(Road.straight(), np.zeros(2)).all()


def test_lines_follow_the_edges_borders_first():
    lines = markings(RAMP, -20.0, 320.0)
    assert [line.outer for line in lines] == [True, True, False, False]
    right, left, beside, between = (line.points for line in lines)
    assert right.tolist() == [[-20, 3.5], [0, 3.5], [100, 3.5], [120, 0], [200, 0], [240, 3.5], [320, 3.5]]
    assert set(left[:, 1]) == {10.5} and set(between[:, 1]) == {7.0}
    assert beside.tolist() == [[120, 3.5], [200, 3.5]]
    assert [line.points.tolist() for line in markings(Road.straight(2), 5.0, 9.0)] == [
        [[5, 0], [9, 0]],
        [[5, 7.2], [9, 7.2]],
        [[5, 3.6], [9, 3.6]],
    ]
    assert across(RAMP) == (0.0, 10.5)


def test_a_drawing_shows_the_lanes_where_the_ego_is():
    trace = make_trace(1)
    scene = jax.tree.map(lambda values: values[0], trace.scene)
    scene.lon[0] = 210.0
    drawing = RoadDrawing(style.new_figure(8, 2).subplots(), RAMP, scene.vehicles)
    drawing.show(scene, trace.paths[0], trace.plans[0])
    right, left = drawing.borders.get_segments()
    assert right.tolist() == [[-35, 0], [-10, 0], [30, 3.5], [105, 3.5]]
    assert left.tolist() == [[-35, 10.5], [-10, 10.5], [30, 10.5], [105, 10.5]]
    (surface,) = drawing.surface.get_paths()
    assert surface.vertices[:, 1].min() == 0 and surface.vertices[:, 1].max() == 10.5
    dashes = np.array(drawing.dashes.get_segments())
    beside = dashes[np.abs(dashes[:, 0, 1] - 3.5) < 1.0]
    assert len(beside) and beside[:, 1, 0].max() < 30 < dashes[:, 1, 0].max()


def test_pictures_say_that_a_bend_is_unrolled():
    straight = Road.straight()
    bent = Road(straight.edges, 300.0, ReferenceLine(np.zeros(2), 0.0, np.full(301, 1 / 400), 300.0))
    assert ahead_label(straight) == "distance ahead of the ego [m]"
    assert "unrolled" in ahead_label(bent)
    trace = make_trace(1)
    figure = snapshots(type(trace)(**{**vars(trace), "road": bent}), steps=[0])
    assert figure.axes[-1].get_xlabel() == ahead_label(bent)
    low, high = figure.axes[0].get_ylim()
    assert (low, high) == pytest.approx((-VERGE, 10.8 + VERGE))
