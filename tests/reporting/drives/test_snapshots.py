"""Snapshots show the moments that matter."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from report_fakes import LEAVES, make_stray, make_trace

from coverdrive.errors import DataError
from coverdrive.plan import Status
from coverdrive.reference_line import ReferenceLine
from coverdrive.reporting.drives.reasons import Reason
from coverdrive.reporting.drives.road_drawing import VERGE, height_of
from coverdrive.reporting.drives.snapshots import interesting_moments, snapshots
from coverdrive.reporting.plotting.drawing import save
from coverdrive.road import Road
from coverdrive.road_markings import ahead_label
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.misses import find_windows


def moments_of(trace: Trace, count: int = 4) -> list[tuple[int, str]]:
    return interesting_moments(trace, find_windows(trace), count)


pytestmark = pytest.mark.usefixtures("no_global_change")


def test_lane_change_and_overtaking_are_found(trace):
    moments = dict(moments_of(trace))
    lane = trace.road.lane_of(trace.scene.lat[:, 0])
    changed = np.flatnonzero(np.diff(lane))
    assert changed.tolist() == [4, 11]
    assert moments[4] == "changes lane"
    assert moments[8] == "overtakes"


def test_otherwise_the_densest_moment_is_chosen():
    trace = make_trace(40)
    worst, later = moments_of(trace, 2)
    assert worst == (11, "changes lane, worst moment")
    assert later == (21, "vehicles within 20 m: 1")


def test_the_end_of_a_collision_is_always_among_them():
    step, remark = moments_of(make_trace(kind=Kind.REAR_END))[-1]
    assert step == 11
    assert remark.endswith("just before a rear-end collision")


def test_where_a_collision_began_is_always_among_them():
    trace = make_trace(40, kind=Kind.REAR_END)
    plans = [
        replace(plan, status=Status.UNSAFE if step >= 25 else Status.SOLVED) for step, plan in enumerate(trace.plans)
    ]
    moments = moments_of(replace(trace, plans=tuple(plans)), 2)
    assert moments[-1] == (25, "clear plan lost, 1.5 s before a rear-end collision")


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 5, 9, 40, 200])
@pytest.mark.parametrize("count", [1, 4])
def test_moments_are_in_order_and_spread(steps, count):
    chosen = [step for step, _ in moments_of(make_trace(steps), count)]
    assert len(chosen) == min(steps, count)
    assert (np.diff(chosen) >= max(1, steps // count // 2)).all()
    assert chosen[0] >= 0
    assert chosen[-1] < steps


LONG = (
    "would meet 21 of 360 predicted paths, hardest that of the vehicle ahead partly in the same lane, in 2.9 s, at "
    "12.3 m/s and would get 0.04 m off the road"
)
"""a reason"""


def test_no_title_is_cut_off(trace, monkeypatch):
    monkeypatch.setattr("coverdrive.reporting.drives.snapshots.reason_of", lambda trace, step: Reason(LONG))
    figure = snapshots(trace)
    FigureCanvasAgg(figure).draw()
    for axes in figure.axes:
        title = axes._left_title
        assert " ".join(title.get_text().split()).endswith(LONG)
        assert figure.bbox.containsx(title.get_window_extent().x1)
        assert axes.bbox.height > 0.9 * height_of(trace.road, axes.bbox.width)


def test_one_panel_for_each_moment(trace, tmp_path):
    figure = snapshots(trace, steps=[0, 7])
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    why = "invalid input: what was seen of the ego or of another vehicle cannot be true"
    assert titles == ["(a)  0.0 s, ego 24.4 m/s", f"(b)  0.7 s, ego 24.4 m/s\n{why}"]
    assert all(axes.get_xlim() == (-35, 105) and axes.get_aspect() == 1 for axes in figure.axes)
    png, pdf = save(figure, tmp_path / "snapshots")
    width, height = struct.unpack(">II", png.read_bytes()[16:24])
    assert width == 1432
    assert height < width
    assert pdf.read_bytes().startswith(b"%PDF-")


def test_four_moments_are_chosen_by_default(trace):
    figure = snapshots(trace)
    assert [axes.get_title(loc="left")[:3] for axes in figure.axes] == ["(a)", "(b)", "(c)", "(d)"]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-1] == "predicted set, now … 2 s ahead"


def test_frames_are_explained_where_there_are_some():
    def labels(step):
        return [text.get_text() for text in snapshots(make_stray(), steps=[step]).legends[0].get_texts()]

    assert labels(LEAVES)[-1] == "left its predicted set"
    assert len(labels(LEAVES - 1)) == len(labels(LEAVES)) - 1


def test_the_first_contact_is_marked_and_explained_where_nothing_is_clear(trace):
    def drawn(status):
        plan, paths = trace.plans[0], trace.paths[0]
        in_the_way = replace(paths, points=paths.points + np.array([plan.states[0, 0] - 30.0, 0.0]))
        changed = replace(trace, plans=(replace(plan, status=status),), paths=(in_the_way,))
        figure = snapshots(changed, steps=[0])
        labels = [text.get_text() for text in figure.legends[0].get_texts()]
        dashed = [each for each in figure.axes[0].collections if each.get_linestyle()[0][1] is not None]
        return "first contact of a plan that is not clear" in labels, [len(each.get_paths()) for each in dashed]

    assert drawn(Status.UNSAFE) == (True, [2])
    assert drawn(Status.SOLVED) == (False, [0])


def test_wide_roads_are_drawn_as_wide_as_narrow_ones():
    def width(lanes):
        trace = replace(make_trace(), road=Road.straight(lanes))
        figure = snapshots(trace, steps=[0, 1, 2])
        figure.draw_without_rendering()
        return figure.axes[0].get_position().width

    assert width(6) == pytest.approx(width(3), abs=0.03) and width(3) > 0.85


@pytest.mark.parametrize("steps", [[], [12], [-1]])
def test_steps_that_do_not_exist_are_refused(trace, steps):
    with pytest.raises(DataError, match="from 0 to 11"):
        snapshots(trace, steps=steps)


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
