"""Bodies on roads that bend are within the boxes that the planner makes of them."""

import numpy as np
import pytest
from bent_roads import LENGTH, bent_road, in_map, outline
from planning_scenes import CAR, CONSTANTS, PROBLEM

from coverdrive.errors import DataError
from coverdrive.geometry import bent_half_sizes, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.obstacles import own_half_sizes
from coverdrive.planning.problem.road_table import on_road, table_of
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road

MOTORCYCLE, SEDAN, TRUCK = np.array([[1.1, 0.4], [2.4, 0.95], [9.0, 1.3]])


def extent(states: np.ndarray, half_sizes: np.ndarray, road: Road) -> np.ndarray:
    """[m] how far bodies reach from their centres along lon and lat: least and largest (…, 2, 2)."""
    points = outline(*in_map(states, road), half_sizes, 41)
    offset = np.stack(road.to_road(points[..., 0], points[..., 1]), axis=-1) - states[..., None, :2]
    return np.stack([offset.min(-2), offset.max(-2)], axis=-2)


@pytest.mark.parametrize("radius", [50.0, 150.0, 400.0, 1e5])
@pytest.mark.parametrize("half_sizes", [MOTORCYCLE, SEDAN, TRUCK], ids=["motorcycle", "sedan", "truck"])
def test_bent_boxes_hold_bodies(radius: float, half_sizes: np.ndarray) -> None:
    """On roads of changing curvature, 5.4 m to either side of the line or more, in all headings that occur."""
    nearest, length = np.inf, min(LENGTH, 4 * radius)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        road = bent_road(rng, 1 / radius, tapers=False, length=length)
        states = rng.uniform([30, -1.0, 0, -0.35], [length - 30, 11.8, 0, 0.35], (50, 4))
        states[:25, 3] = 0.0
        reach = extent(states, half_sizes, road)
        flat = turned_half_extents(half_sizes, states[:, 3])
        near = [np.abs(road.curvature(np.linspace(lon - 15, lon + 15, 61))).max() for lon in states[:, 0]]
        aside = np.abs(states[:, 1] - road.line.lat) + flat[:, 1]
        box = bent_half_sizes(flat, np.hypot(*half_sizes), np.array(near), aside)
        room = box - np.abs(reach).max(axis=1)
        assert room.min() >= -1e-9
        nearest = min(nearest, room[:, 1].min())
    assert nearest < 0.02  # across the road it is not much more than needed


def test_without_it_they_are_not_held() -> None:
    """The negative control: a truck leaves its straight box by the bow of its side, 9²/(2·150) m."""
    line = ReferenceLine(np.zeros(2), 0.0, np.full(301, 1 / 150), LENGTH, lat=5.4)
    reach = extent(np.array([300.0, 5.4, 0.0, 0.0]), TRUCK, Road(np.arange(4) * 3.6, LENGTH, line))
    assert -reach[0, 1] - 1.3 == pytest.approx(81 / 300, rel=0.02)
    assert reach[1, 1] == pytest.approx(1.3)
    box = bent_half_sizes(TRUCK, np.hypot(*TRUCK), 1 / 150, 1.3)
    assert box[1] == pytest.approx(1.3 + 81 / 300, abs=0.07)
    np.testing.assert_array_equal(bent_half_sizes(TRUCK, np.hypot(*TRUCK), 0.0, 1.3), TRUCK)


def test_the_ego_is_within_its_own_box() -> None:
    for seed in range(15):
        rng = np.random.default_rng(seed)
        road = bent_road(rng, tapers=False)
        states = rng.uniform([30, 0.9, 0, -0.35], [570, 9.9, 0, 0.35], (50, 4))
        own = np.stack(own_half_sizes(np.abs(states[:, 3]), table_of(road, PROBLEM).vehicle), axis=-1)
        assert (own - np.abs(extent(states, CAR.half_sizes, road)).max(axis=1)).min() >= 0


@pytest.mark.parametrize("growth", [0.0, 0.3, 3.0])
def test_boxes_of_paths_hold_the_bodies_at_any_time(growth: float) -> None:
    """Bodies that turn as their paths do, at any place in their boxes, also between the points of the paths."""
    time, share = 0.25 * np.arange(13), np.linspace(0, 1, 11)[:, None]
    for seed in range(12):
        rng = np.random.default_rng(seed)
        road = bent_road(rng, tapers=False)
        size = [MOTORCYCLE, SEDAN, TRUCK][seed % 3]
        start, speed, drift = rng.uniform([150, 2.0], [350, 8.8]), rng.uniform(1, 25), rng.uniform(-0.5, 0.5)
        points = start + np.outer(time, [speed, drift])
        heading = np.arctan2(drift, speed)
        flat = turned_half_extents(size, heading)
        half_sizes = flat + growth * time[:, None]
        paths = on_road(
            PredictedPaths(points[None], np.zeros(1, int), half_sizes[None], 0.25), 0.0, table_of(road, PROBLEM)
        )
        for k in range(12):
            centre = points[k] + share * (points[k + 1] - points[k])
            room = (half_sizes[k] + share * (half_sizes[k + 1] - half_sizes[k])) - flat
            box = paths.half_sizes[0, k] + share * (paths.half_sizes[0, k + 1] - paths.half_sizes[0, k])
            at = centre + rng.choice([-1, 1], centre.shape) * room
            states = np.column_stack([at, np.zeros(11), np.full(11, heading)])
            reach = extent(states, size, road) + (at - centre)[:, None]
            assert (box - np.abs(reach).max(axis=1)).min() >= -1e-9


def test_edges_are_the_innermost_ones_over_the_body() -> None:
    lat = np.array([[0, 3.6, 7.2, 10.8], [0, 3.6, 7.2, 10.8], [3.6, 3.6, 7.2, 10.8], [3.6, 3.6, 7.2, 10.8]])
    road = Road(np.arange(4) * 3.6, LENGTH, changing=LaneEdges(np.array([0, 200.3, 233.3, 600.0]), lat))
    rows = table_of(road, PROBLEM).road.rows
    np.testing.assert_allclose(rows[:, 2], 10.8)
    places = np.linspace(0, 580, 20_000)
    row = np.interp(places, 2.0 * np.arange(len(rows)), rows[:, 1])
    for offset in np.linspace(-2.45, 2.45, 9):
        assert (row - road.edges_at(places + offset)[:, 0]).min() >= -1e-9
    assert (row - road.edges_at(places + 12)[:, 0]).max() <= 1e-9  # nor much beyond
    ends = table_of(road, PROBLEM).ends
    assert ends.shape == (1, 2) and 214 < ends[0, 0] - 2 < 217
    assert ends[0, 1] + 1.5 == pytest.approx(road.edges_at(ends[0, 0] - 2)[0])


def test_what_stands_where_a_lane_ends_is_an_obstacle() -> None:
    lat = np.array([[0, 3.6, 7.2], [0, 3.6, 7.2], [0, 3.6, 3.6], [0, 3.6, 3.6]])
    table = table_of(Road(np.arange(3) * 3.6, LENGTH, changing=LaneEdges(np.array([0, 300, 320, 600.0]), lat)), PROBLEM)
    nobody = PredictedPaths(np.zeros((0, 13, 2)), np.zeros(0, int), np.zeros((0, 13, 2)), 0.25)
    assert len(on_road(nobody, 0.0, table)) == 0  # too far
    paths = on_road(nobody, 100.0, table)
    assert len(paths) == 1 and paths.vehicle[0] < 0
    assert 310 <= paths.points[0, 0, 0] - paths.half_sizes[0, 0, 0] <= 314
    assert paths.points[0, 0, 1] - paths.half_sizes[0, 0, 1] > 3.6


def test_a_long_body_in_a_tight_curve_is_large() -> None:
    for aside in (0.0, 4.0, 10.0):
        sizes = bent_half_sizes(np.array([9.0, 1.3]), 9.1, np.linspace(0.0, 1 / 20, 50), aside)
        assert (np.diff(sizes, axis=0) >= -1e-9).all()
        assert sizes[-1, 0] > 18.0


def test_nothing_stands_where_a_lane_in_the_middle_ends() -> None:
    lat = np.array([[0, 3.6, 7.2, 10.8], [0, 3.6, 7.2, 10.8], [0, 5.4, 5.4, 10.8], [0, 5.4, 5.4, 10.8]])
    changing = LaneEdges(np.array([0, 200, 220, 600.0]), lat)
    assert len(table_of(Road(np.arange(4) * 3.6, LENGTH, changing=changing), PROBLEM).ends) == 0


def test_a_wide_road_far_from_a_tight_curve_makes_nobody_larger() -> None:
    lat = np.array([[0, 3.6, 32.4], [0, 3.6, 32.4], [0, 3.6, 3.6], [0, 3.6, 3.6]])
    changing = LaneEdges(np.array([0, 200, 300, 600.0]), lat)
    line = ReferenceLine(np.zeros(2), 0.0, np.where(np.arange(601) < 400, 0.0, 1 / 30), LENGTH)
    wide = table_of(Road(np.array([0.0, 3.6, 32.4]), LENGTH, line, changing), PROBLEM)
    narrow = table_of(Road(np.array([0.0, 3.6]), LENGTH, line), PROBLEM)
    assert (wide.vehicle.length, wide.vehicle.width) == pytest.approx((narrow.vehicle.length, narrow.vehicle.width))


def test_roads_that_are_not_for_it() -> None:
    edges = np.arange(4) * 3.6
    line = ReferenceLine(np.zeros(2), 0.0, np.full(301, 1 / 50), LENGTH, lat=-20.0)
    with pytest.raises(DataError, match=r"curve of 50 m radius on a road whose edge is 31 m"):
        table_of(Road(edges, LENGTH, line), PROBLEM)
    with pytest.raises(DataError, match=r"curve of 16 m radius"):
        ReferenceLine(np.zeros(2), 0.0, np.full(601, 1 / 16), LENGTH)


def test_wanted_speeds_fall_before_a_curve_and_hold_in_it() -> None:
    curvature = np.where(np.arange(301) >= 240, 1 / 150, 0.0)
    road = Road(np.arange(4) * 3.6, LENGTH, ReferenceLine(np.zeros(2), 0.0, curvature, LENGTH, lat=5.4))
    table = table_of(road, PROBLEM)
    assert table.wanted_from(0.0, 30.0, PROBLEM, None)[0] == PROBLEM.cost.reference_speed
    assert table.wanted_from(0.0, 30.0, PROBLEM, 20.0)[0] == 20.0
    assert table.wanted_from(0.0, 1.0, PROBLEM, -2.0)[-1] == -2.0
    assert table.wanted_from(0.0, 10.0, PROBLEM, 9.0, 2.0)[[0, 2, -1]] == pytest.approx([9.0, 9.0, 4.0])
    comfort = np.sqrt(PROBLEM.cost.curve_share * 4 * 150)
    usual, urgent = table.wanted
    assert 0.9 * comfort < usual[-1] <= comfort
    for each in table.wanted:
        slower = np.diff(each**2) / (2 * 2.0)
        assert slower.min() == pytest.approx(-PROBLEM.cost.curve_braking)
    assert usual[-1] < urgent[-1] < table.road.rows[-1, 3] <= np.sqrt(0.9 * 4 * 150)
    wanted = table.wanted_from(400.0, 30.0, PROBLEM, 40.0)
    assert (np.diff(wanted) < 0).all() and len(wanted) == 13
    hurried = table.wanted_from(400.0, 30.0, PROBLEM, 40.0, urgent=True)
    assert (hurried > wanted).all() and (np.diff(hurried) < 0).all()
    bold = PROBLEM.model_copy(update={"cost": PROBLEM.cost.model_copy(update={"curve_share": 0.9})})
    assert np.array_equal(*table_of(road, bold).wanted)
    assert table.vehicle.braking < CAR.max_deceleration == CONSTANTS.vehicle.braking
