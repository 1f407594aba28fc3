"""What one moment of a drive is drawn from."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import same_color
from report_fakes import HORIZON, LEAVES, PATHS_PER_VEHICLE, STEPS, make_stray, make_trace

from coverdrive.geometry import body_corners, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.reporting.drives.active_constraints import active_constraints
from coverdrive.reporting.drives.road_drawing import RoadDrawing, set_boxes
from coverdrive.reporting.plotting import style
from coverdrive.simulation.measures.misses import find_windows, left_recently
from ramp_road import RAMP

pytestmark = pytest.mark.usefixtures("no_global_change")

PATHS = 2 * PATHS_PER_VEHICLE


@pytest.fixture
def drawing(trace) -> RoadDrawing:
    axes = style.new_figure(8, 2).subplots()
    return RoadDrawing(axes, trace.road, trace.scene.vehicles)


def polygons(collection) -> list[np.ndarray]:
    return [path.vertices[:4] for path in collection.get_paths()]


def test_every_vehicle_path_and_second_has_its_artist(drawing, trace):
    drawing.show_moment(trace, 0)
    assert len(drawing.vehicles.get_paths()) == 3
    assert len(drawing.members.get_segments()) == PATHS
    assert len(drawing.bodies.get_paths()) == 2
    assert len(drawing.plan.get_xdata()) == HORIZON + 1
    sets = drawing.sets.get_paths()
    assert len(sets) == 2 * HORIZON + 1
    assert all(len(path.to_polygons()) == PATHS for path in sets)


def test_the_ego_is_blue_and_at_the_origin(drawing, trace):
    drawing.show_moment(trace, 5)
    own, ahead, _ = polygons(drawing.vehicles)
    assert own.mean(0) == pytest.approx([0, trace.scene.lat[5, 0]])
    assert ahead.mean(0) == pytest.approx([40 - 5 * 0.4, 1.8])
    colours = drawing.vehicles.get_facecolor()
    assert same_color(colours[0], style.EGO)
    assert same_color(colours[1], style.OTHER)
    assert same_color(colours[2], style.OTHER)


def test_speeds_stand_in_the_vehicles_and_empty_slots_have_none(drawing, trace):
    drawing.show_moment(trace, 1)
    assert [text.get_text() for text in drawing.speeds] == ["24", "20", "20", ""]
    assert drawing.speeds[1].get_position() == pytest.approx((40 - 0.4, 1.8))


@pytest.mark.parametrize(("ahead", "speed"), [(-33, "20"), (-34.9, ""), (103, "20"), (104.9, "")])
def test_a_number_that_would_be_cut_off_is_left_out(drawing, trace, ahead, speed):
    lon = trace.scene.lon.copy()
    lon[0, 1] = lon[0, 0] + ahead
    drawing.show_moment(replace(trace, scene=replace(trace.scene, lon=lon)), 0)
    assert drawing.speeds[1].get_text() == speed


def test_the_plan_starts_at_the_ego(drawing, trace):
    drawing.show_moment(trace, 3)
    assert drawing.plan.get_xydata()[0] == pytest.approx([0, trace.scene.lat[3, 0]])
    assert polygons(drawing.bodies)[0].mean(0) == pytest.approx([24.4, trace.scene.lat[3, 0]])


def test_the_last_moment_shows_what_was_planned_the_step_before_where_it_belongs(drawing, trace):
    drawing.show_moment(trace, STEPS - 1)
    plan, members = drawing.plan.get_xydata(), np.array(drawing.members.get_segments())
    drawing.show_moment(trace, STEPS)
    moved = [trace.scene.lon[STEPS, 0] - trace.scene.lon[STEPS - 1, 0], 0.0]
    assert drawing.plan.get_xydata() == pytest.approx(plan - moved)
    assert np.array(drawing.members.get_segments()) == pytest.approx(members - moved)
    assert polygons(drawing.vehicles)[0].mean(0) == pytest.approx([0, trace.scene.lat[STEPS, 0]])


def test_active_boxes_have_the_hue_of_their_time(drawing, trace):
    step = next(step for step in range(STEPS) if active_constraints(trace, step, ProblemSettings()).any())
    drawing.show_moment(trace, step, ProblemSettings())
    active = active_constraints(trace, step, ProblemSettings())
    for box, colour, (path, point) in zip(
        polygons(drawing.active), drawing.active.get_edgecolor(), np.argwhere(active), strict=True
    ):
        there = trace.paths[step].points[path, point] - [trace.scene.lon[step, 0], 0.0]
        assert box.mean(0) == pytest.approx(there)
        assert same_color(colour[:3], style.TIMES(point / HORIZON)[:3])


def test_vehicles_that_left_their_sets_have_a_frame(drawing):
    stray = make_stray()
    left = left_recently(stray, find_windows(stray))
    drawing.show_moment(stray, LEAVES - 1, left=left)
    assert len(drawing.frames.get_paths()) == 0
    drawing.show_moment(stray, LEAVES, left=left)
    (frame,) = polygons(drawing.frames)
    body = polygons(drawing.vehicles)[2]
    assert np.ptp(frame, axis=0) == pytest.approx(np.ptp(body, axis=0) + 0.9)
    assert frame.mean(0) == pytest.approx(body.mean(0))
    drawing.show_moment(stray, LEAVES)
    assert len(drawing.frames.get_paths()) == 0


def test_an_empty_prediction_is_drawn_as_none(drawing, trace):
    scene = drawing.show_moment(trace, 0)
    drawing.show(scene, trace.paths[0].of(np.zeros(PATHS, dtype=bool)), trace.plans[0])
    assert len(drawing.sets.get_paths()) == 0


def test_later_boxes_lie_below_earlier_ones_and_are_paler(drawing, trace):
    drawing.show_moment(trace, 0)
    fronts = [path.vertices[:, 0].max() for path in drawing.sets.get_paths()]
    assert fronts == sorted(fronts, reverse=True)
    brightness = drawing.sets.get_facecolor()[:, :3].sum(1)
    assert (np.diff(brightness) < 0).all()


def test_lane_markings_stand_still_on_the_road(drawing, trace):
    drawing.show_moment(trace, 0)
    before = np.array(drawing.dashes.get_segments())
    moved = trace.scene.lon[7, 0] - trace.scene.lon[0, 0]
    drawing.show_moment(trace, 7)
    after = np.array(drawing.dashes.get_segments()) + np.array([moved, 0])
    assert {3.6, 7.2} == set(np.round(after[..., 1].ravel(), 6))
    offset = (after[:, 0, 0].min() - before[:, 0, 0].min()) % 12.0
    assert min(offset, 12.0 - offset) == pytest.approx(0, abs=1e-9)
    assert np.array(drawing.dashes.get_segments())[..., 0].min() <= -30
    assert np.array(drawing.dashes.get_segments())[..., 0].max() >= 60 - 12


def test_everything_that_moves_is_listed_once_from_back_to_front(drawing):
    moving = drawing.artists
    assert len(set(map(id, moving))) == len(moving)
    order = [artist.get_zorder() for artist in moving]
    assert order == sorted(order)


def test_boxes_at_the_points_and_halfway_between():
    points = np.array([[[0.0, 0.0], [8.0, 1.0]]])
    half_sizes = np.array([[[2.0, 1.0], [4.0, 2.0]]])
    boxes = set_boxes(PredictedPaths(points, np.array([1]), half_sizes, 0.25))
    assert boxes.shape == (3, 1, 4, 2)
    assert boxes.min(2)[:, 0].tolist() == [[-2, -1], [1, -1], [4, -1]]
    assert boxes.max(2)[:, 0].tolist() == [[2, 1], [7, 2], [12, 3]]


def test_fast_vehicles_leave_no_gaps(trace):
    boxes = set_boxes(trace.paths[0])
    assert (boxes[1:, ..., 0].min(-1) <= boxes[:-1, ..., 0].max(-1)).all()


@given(st.floats(-np.pi, np.pi), st.floats(0.1, 10), st.floats(0.1, 3))
def test_turned_bodies_have_the_extents_of_the_geometry(heading, half_length, half_width):
    half_sizes = np.array([half_length, half_width])
    corners = body_corners(np.array([5.0, -2.0, 20.0, heading]), half_sizes)
    extent = np.ptp(corners, axis=0) / 2
    np.testing.assert_allclose(extent, turned_half_extents(half_sizes, np.array(heading)), atol=1e-9)
    np.testing.assert_allclose(corners.mean(0), [5.0, -2.0], atol=1e-9)


def test_a_left_turned_body_points_left():
    corners = body_corners(np.array([0.0, 0.0, 20.0, np.pi / 2]), np.array([2.0, 1.0]))
    assert corners[0] == pytest.approx([-1.0, 2.0])  # its front left corner


def test_traces_of_any_length_are_drawn():
    short = make_trace(1)
    axes = style.new_figure(8, 2).subplots()
    scene = RoadDrawing(axes, short.road, 4).show_moment(short, 1)
    assert scene.lon.shape == (4,)


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
