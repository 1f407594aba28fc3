from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulation_fakes import ConstantPlanner, make_scene

from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Status
from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.drives.trace import Decision, Step, Trace, make_trace
from coverdrive.simulation.measures import metrics
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.traffic.model import TrafficStep
from coverdrive.simulation.traffic.motion import constant_velocity

NOBODY = PredictedPaths(np.zeros((0, 13, 2)), np.zeros(0, dtype=int), np.zeros((0, 13, 2)), 0.25)


def trace_of(scenes, statuses=None, slacks=None, seconds=None, stuck=None, missed=None) -> Trace:
    """A trace through hand-made scenes."""
    road = Road.straight()
    steps = []
    for k, scene in enumerate(scenes[1:]):
        plan = ConstantPlanner().plan(np.zeros(4), NOBODY, road)
        status = statuses[k] if statuses else Status.SOLVED
        slack = np.full(12, slacks[k] if slacks else 0.0)
        plan = type(plan)(**{**vars(plan), "status": status, "slack": slack})
        usual = TrafficStep.without_bases(scene)
        moved = replace(usual, stuck=stuck[k] if stuck else usual.stuck, missed=missed[k] if missed else usual.missed)
        took = seconds[k] if seconds else 0.1
        steps.append(Step(Decision(NOBODY, plan, 0.0, took, 2 * took), moved))
    return make_trace(scenes[0], road, steps, 0.1)


def test_speed_and_distance_of_the_ego():
    trace = trace_of([make_scene([0, 50], [1.8, 1.8], [20, 0]), make_scene([3, 50], [1.8, 1.8], [40, 0])])
    found = measure(trace, 0, 0)
    assert (found["mean_speed"], found["distance"]) == (30, 3)


def test_a_lane_change_counts_when_the_other_lane_is_reached():
    def changes(*lats):
        return metrics.lane_changes(trace_of([make_scene([0], [lat]) for lat in lats]))

    assert changes(1.8, 3.0, 4.2, 5.4) == 1
    assert changes(1.8, 3.5, 3.7, 3.5, 3.7, 1.8) == 0  # dithering on the line
    assert changes(1.8, 5.4, 9.0, 5.4) == 3
    assert changes(1.8, 1.9, 1.7) == 0


def test_lanes_and_edges_are_those_where_the_ego_is():
    edges = np.array([0.0, 3.6, 7.2])
    along = LaneEdges(np.array([0.0, 40.0, 80.0]), np.array([edges, edges, [3.6, 3.6, 7.2]]))
    road = Road(edges, 200.0, changing=along)
    merged = trace_of([make_scene([lon], [lat]) for lon, lat in ((0, 1.8), (30, 3.0), (60, 5.4), (100, 5.4))])
    beside = trace_of([make_scene([lon], [1.8]) for lon in (0, 30, 60, 100)])
    assert metrics.lane_changes(replace(merged, road=road)) == 1
    assert metrics.road_departure(replace(merged, road=road)) == 0
    assert metrics.road_departure(replace(beside, road=road)) == pytest.approx(3.6 - (1.8 - 0.95))


def test_overtakes_count_who_was_ahead_and_is_behind():
    start, end = make_scene([0, 10, 20, -5], [1.8] * 4), make_scene([50, 40, 70, 55], [1.8] * 4)
    assert metrics.overtakes(trace_of([start, end])) == 1
    assert metrics.overtakes(trace_of([end, start])) == 1


def test_road_departure_counts_the_body():
    assert metrics.road_departure(trace_of([make_scene([0], [1.8]), make_scene([0], [0.95])])) == 0
    assert metrics.road_departure(trace_of([make_scene([0], [1.8]), make_scene([0], [0.5])])) == pytest.approx(0.45)
    assert metrics.road_departure(trace_of([make_scene([0], [10.8]), make_scene([0], [5])])) == pytest.approx(0.95)


def test_minimum_gap_is_between_bodies():
    trace = trace_of([make_scene([0, 20], [1.8, 1.8]), make_scene([0, 7.8], [1.8, 1.8 + 1.9 + 4.0])])
    assert metrics.gaps(trace).min() == pytest.approx(5.0)  # 3 m along, 4 m across
    touching = trace_of([make_scene([0, 20], [1.8, 1.8]), make_scene([0, 4], [1.8, 1.8])])
    assert metrics.gaps(touching).min() == 0
    alone = trace_of([make_scene([0], [1.8])] * 2)
    assert metrics.gaps(alone).min() == np.inf
    assert metrics.distances(alone).time_to_collision.min() == np.inf


@pytest.mark.parametrize(
    ("lon", "lat", "speed", "heading", "expected"),
    [
        (24.8, 1.8, 10.0, 0.0, 2.0),  # closing 20 m at 10 m/s
        (24.8, 1.8, 20.0, 0.0, np.inf),
        (24.8, 1.8, 30.0, 0.0, np.inf),
        (-24.8, 1.8, 30.0, 0.0, 2.0),
        (24.8, 5.4, 10.0, 0.0, np.inf),  # passes in the other lane
        (2.0, 1.8, 20.0, 0.0, 0.0),  # in contact
        (24.8, 1.8, 20.0, 5e-324, np.inf),  # a relative velocity that overflows the quotient
    ],
)
def test_time_to_collision_by_hand(lon, lat, speed, heading, expected):
    scene = make_scene([0, lon], [1.8, lat], [20.0, speed], [0.0, heading])
    assert metrics.distances(trace_of([scene, scene])).time_to_collision.min() == pytest.approx(expected)


@settings(max_examples=100, deadline=None)
@given(st.floats(-40, 40), st.floats(-8, 8), st.floats(5, 35), st.floats(-0.3, 0.3))
def test_time_to_collision_agrees_with_stepping_through_time(lon, lat, speed, heading):
    scene = make_scene([0, lon], [1.8, lat], [20.0, speed], [0.0, heading])
    found = metrics.distances(trace_of([scene, scene])).time_to_collision.min()
    times = np.arange(0.0, 10.0, 0.002)
    states = constant_velocity(scene.states, times)
    extent = turned_half_extents(np.array([2.4, 0.95]), states[..., 3]).sum(0)
    overlap = (np.abs(states[1, :, :2] - states[0, :, :2]) < extent).all(-1)
    if overlap.any():
        assert found == pytest.approx(times[overlap.argmax()], abs=0.0021)
    elif found < 10:  # a brush shorter than the time step
        middle = constant_velocity(scene.states, np.array([found]))[:, 0]
        assert (np.abs(middle[1, :2] - middle[0, :2]) <= extent[0] + 1e-6).all()


def test_slack_planning_time_and_status():
    scene = make_scene([0], [1.8])
    trace = trace_of(
        [scene] * 5,
        statuses=[Status.SOLVED, Status.SOLVED, Status.FALLBACK, Status.UNSAFE],
        slacks=[0.0, 0.3, 0.1, 0.2],
        seconds=[0.1, 0.2, 0.3, 0.4],
    )
    found = measure(trace, 0, 0)
    assert found["maximum_slack"] == 0.3
    assert found["planning_median"] == pytest.approx(0.25)
    assert found["planning_maximum"] == pytest.approx(0.4)
    assert found["planning_wall_p99"] == pytest.approx(np.quantile([0.2, 0.4, 0.6, 0.8], 0.99))
    shares = [found[f"share_{status}"] for status in ("solved", "fallback", "unsafe", "invalid_input")]
    assert shares == [0.5, 0.25, 0.25, 0.0]


def test_jerk_and_braking_come_from_the_inputs_that_were_applied():
    scene = make_scene([0], [1.8], speed=[10.0])
    trace = trace_of([scene] * 4)
    plans = []
    for plan, applied in zip(trace.plans, [(0.0, 0.0), (-1.0, 0.02), (1.0, 0.0)], strict=True):
        plans.append(type(plan)(**{**vars(plan), "inputs": np.tile(applied, (12, 1))}))
    trace = type(trace)(**{**vars(trace), "plans": tuple(plans)})
    along, across = metrics.jerk(trace)
    assert along == pytest.approx(np.sqrt((10**2 + 20**2) / 2))
    assert across == pytest.approx(2.0)  # 10 m/s · 0.02 rad/s within 0.1 s, there and back
    assert metrics.hardest_braking(trace) == 1.0
    assert metrics.jerk(trace_of([scene] * 2)) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("lon", "lat", "there", "expected"),
    [
        (-20.0, 1.8, True, 4.0),
        (20.0, 1.8, True, 0.0),  # ahead
        (-20.0, 5.4, True, 20.0),  # in another lane, so that the one behind it follows
        (-4.8 - 2.9 * 30.0, 1.8, True, 4.0),
        (-4.8 - 3.1 * 30.0, 1.8, True, 0.0),  # free of the ego
        (-20.0, 1.8, False, 0.0),  # has left the picture, and cannot have stopped there
    ],
)
def test_braking_behind_is_that_of_the_follower_while_it_is_near(lon, lat, there, expected):
    """By hand: of three steps of 0.1 s it brakes by 0.4 m/s in the second, and who is 10 m behind it by 2 in all."""
    scenes = []
    for k, speed in enumerate((30.0, 30.0, 29.6, 29.6)):
        scene = make_scene(np.array([0, lon, lon - 10]) + 3.0 * k, [1.8, lat, 1.8], [30.0, speed, 30.0 - 2 * k])
        scene.valid[1] = there or k < 2
        scene.valid[2] = lon < 0 and there
        scenes.append(scene)
    trace = trace_of(scenes)
    assert metrics.hardest_braking_behind(trace, metrics.distances(trace)) == pytest.approx(expected)


def test_share_of_plans_with_slack_leaves_out_rounding():
    scene = make_scene([0], [1.8])
    assert measure(trace_of([scene] * 5, slacks=[0.0, 1e-6, 0.01, 0.5]), 0, 0)["share_slack"] == 0.5


def test_vehicles_count_while_they_are_there():
    near, gone = make_scene([0, 6], [1.8, 1.8], [20, 10]), make_scene([0, 3], [1.8, 1.8], [20, 10])
    gone.valid[1] = False
    assert metrics.gaps(trace_of([near, gone])).min() == pytest.approx(1.2)
    assert metrics.distances(trace_of([near, gone])).time_to_collision.min() == pytest.approx(0.12)


def test_stuck_moments_and_impossible_choices_are_counted_one_by_one():
    scene = make_scene([0, 10, 20], [1.8] * 3)
    trace = trace_of(
        [scene] * 3,
        stuck=[np.array([False, True, True]), np.array([False, True, False])],
        missed=[np.array([False, False, True]), np.array([False, False, False])],
    )
    found = measure(trace, 0, 0)
    assert (found["traffic_stuck"], found["impossible_choices"]) == (3, 1)


def test_collisions_of_the_traffic_count_pairs_once_and_leave_the_ego_out():
    apart = make_scene([0, 20, 40, 60], [1.8] * 4)
    pair, own_and_pair = make_scene([0, 20, 22, 60], [1.8] * 4), make_scene([19, 20, 22, 60], [1.8] * 4)
    assert metrics.traffic_collisions(trace_of([apart, apart])) == 0
    assert metrics.traffic_collisions(trace_of([apart, pair, pair, own_and_pair])) == 1
    assert metrics.traffic_collisions(trace_of([pair, make_scene([0, 20, 40, 41], [1.8] * 4)])) == 2


@pytest.mark.parametrize(("lon", "expected"), [(4.7 + 4.8, 1), (5.3 + 4.8, 0), (-4.9, 0)])
@pytest.mark.parametrize("status", Status)
def test_driving_into_a_box_counts_where_the_plan_was_called_clear(lon: float, expected: int, status: Status) -> None:
    """The ego comes 5 m in a step, towards a standing car."""
    trace = trace_of([make_scene([0], [1.8]), make_scene([5], [1.8])], statuses=[status])
    points = np.tile([lon, 1.8], (1, 13, 1))
    paths = PredictedPaths(points, np.ones(1, dtype=int), np.tile([2.4, 0.95], (1, 13, 1)), 0.25)
    trace = replace(trace, paths=(paths,))
    assert metrics.clear_contacts(trace) == expected * (status in (Status.SOLVED, Status.FALLBACK))


@pytest.mark.parametrize(("gone_at", "expected"), [(1, 0), (2, 1)])
def test_boxes_are_followed_for_longer_than_a_step_of_their_path(gone_at: int, expected: int) -> None:
    """The ego comes 10 m in 0.1 s; who is 12 m ahead leaves after 0.05 s, or when it is too late."""
    trace = trace_of([make_scene([0], [1.8]), make_scene([10], [1.8])])
    points = np.tile([12.0, 1.8], (1, 13, 1))
    points[:, gone_at + 1 :, 0] = 40.0
    paths = PredictedPaths(points, np.ones(1, dtype=int), np.tile([2.4, 0.95], (1, 13, 1)), 0.05)
    assert metrics.clear_contacts(replace(trace, paths=(paths,))) == expected


def test_a_clear_plan_is_lost_where_none_follows_it() -> None:
    scenes = [make_scene([5.0 * k], [1.8]) for k in range(6)]
    statuses = [Status.SOLVED, Status.UNSAFE, Status.FALLBACK, Status.SOLVED, Status.UNSAFE]
    assert metrics.lost_clear(trace_of(scenes, statuses=statuses)) == 2
