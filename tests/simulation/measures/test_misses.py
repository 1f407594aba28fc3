from dataclasses import replace

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, make_scene

from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Status
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.motion import follow
from coverdrive.road import Road
from coverdrive.simulation.drives.outcome import Cause, Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Decision, Step, Trace, make_trace
from coverdrive.simulation.measures.misses import cause_of, find_windows, left_recently, manoeuvres_in
from coverdrive.simulation.traffic.model import TrafficStep

DT, HORIZON = 0.5, 6
"""the paths have a point every 0.5 s for 3 s"""


def paths_of(*lats, vehicle=None, speed=20.0, start=50.0, tube=1.0) -> PredictedPaths:
    """Straight paths at 20 m/s, one for each lat, with tubes that are round and boxes around them."""
    times = DT * np.arange(HORIZON + 1)
    points = np.stack([np.stack([start + speed * times, np.full(len(times), lat)], -1) for lat in lats])
    half_sizes = np.broadcast_to([2.4 + tube, 0.95 + tube], points.shape)
    return PredictedPaths(points, np.array(vehicle or [1] * len(lats)), half_sizes, DT, np.full(points.shape, tube))


def trace_of(lat, paths, seconds=5.0, outcome=None, valid=None) -> Trace:
    """The ego, and one vehicle at 20 m/s from lon = 50 m whose lat [m] is a function of time; steps of 0.1 s."""
    count = round(seconds / 0.1) + 1
    scenes = []
    for k in range(count):
        scene = make_scene([0.0, 50.0 + 2.0 * k], [1.8, lat(0.1 * k)])
        scene.valid[1] = valid is None or valid(0.1 * k)
        scenes.append(scene)
    plan = ConstantPlanner().plan(np.zeros(4), paths(0), Road.straight())
    moves = map(TrafficStep.without_bases, scenes[1:])
    steps = [Step(Decision(paths(k), plan), moved) for k, moved in enumerate(moves)]
    return make_trace(scenes[0], Road.straight(), steps, 0.1, outcome)


def here(*lats, **settings):
    """Predictions that begin where the vehicle is."""
    return lambda k: paths_of(*lats, start=50.0 + 2.0 * k, **settings)


def test_a_vehicle_on_its_path_is_not_missed_and_late_windows_are_not_counted():
    windows = find_windows(trace_of(lambda t: 1.8, here(1.8)))
    assert windows.seen[:, 1].tolist() == [True] * 21 + [False] * 29  # 5 s, of which the last 3 s are no whole window
    assert not windows.seen[:, 0].any()
    assert not windows.missed.any()
    assert np.isinf(windows.left).all()


def test_the_time_of_leaving_is_that_of_the_first_point_outside():
    windows = find_windows(trace_of(lambda t: 1.8 + (3.0 if t > 2.2 else 0.0), here(1.8)))
    assert windows.left[0, 1] == pytest.approx(2.5)
    assert windows.left[20, 1] == pytest.approx(0.5)
    assert windows.missed[:, 1].sum() == 21
    late = find_windows(trace_of(lambda t: 1.8 + (3.0 if t > 4.2 else 0.0), here(1.8)))
    assert not late.seen[25, 1] and late.left[25, 1] == pytest.approx(2.0)  # left, but not a whole window
    assert late.missed[:, 1].sum() == 8  # those that begin between 1.3 s and 2.0 s


@pytest.mark.parametrize(("aside", "missed"), [(0.0, False), (0.2, True)])
def test_between_recorded_moments_a_vehicle_is_on_the_way_from_one_to_the_next(aside: float, missed: bool):
    """The path has a point every 0.25 s, the drive one every 0.1 s; the vehicle keeps to it while it goes across."""

    def paths(k: int) -> PredictedPaths:
        times = 0.25 * np.arange(13)
        points = np.stack([50.0 + 2.0 * k + 20.0 * times, 1.8 + 0.1 * k + times + aside], -1)[None]
        tube = np.full(points.shape, 0.1)
        return PredictedPaths(points, np.array([1]), tube + np.array([2.4, 0.95]), 0.25, tube)

    windows = find_windows(trace_of(lambda t: 1.8 + t, paths))
    assert windows.seen[:, 1].sum() == 21
    assert windows.missed[:, 1].sum() == 21 * missed


def test_shares_are_of_each_vehicle_and_of_the_windows_asked_for():
    windows = find_windows(trace_of(lambda t: 1.8 + (3.0 if t > 4.2 else 0.0), here(1.8)))
    assert windows.shares == pytest.approx([8 / 21])
    assert windows.of(np.arange(50)[:, None] < 16).shares == pytest.approx([3 / 16])
    assert windows.of(np.arange(50)[:, None] < 0).shares.shape == (0,)


def test_a_lane_change_in_a_drive_is_one_until_it_ends():
    """From 5.4 m to 9 m within 3 s, at constant speed along the road and far ahead of the ego."""
    found = manoeuvres_in(trace_of(lambda t: 5.4 + 1.2 * min(t, 3.0), here(5.4)))
    assert found["lane_change"][:17, 1].all() and found["rest"][18:21, 1].all()
    assert not found["cut_in"].any()


def test_one_path_has_to_hold_the_vehicle_all_the_time():
    windows = find_windows(trace_of(lambda t: 1.8 if t < 1.4 else 5.4, here(1.8, 5.4)))
    assert windows.left[0, 1] == pytest.approx(1.5)
    changed = find_windows(trace_of(lambda t: 5.4, here(1.8, 5.4)))
    assert not changed.missed.any()


def test_the_tube_is_an_ellipse():
    def outside(along, across):
        trace = trace_of(lambda t: 1.8 + across, lambda k: paths_of(1.8, start=50.0 + 2.0 * k - along, tube=1.0))
        return bool(find_windows(trace).missed[:, 1].any())

    assert not outside(0.69, 0.69)
    assert outside(0.73, 0.73)  # in the box of the tube, not in the ellipse


def test_without_a_path_a_vehicle_is_missed_at_once_and_one_that_goes_away_is_not_seen():
    nobody = PredictedPaths(np.zeros((0, 7, 2)), np.zeros(0, dtype=int), np.zeros((0, 7, 2)), DT)
    windows = find_windows(trace_of(lambda t: 1.8, lambda k: nobody))
    assert windows.missed[:21, 1].all() and np.allclose(windows.left[:21, 1], 0.1)
    gone = find_windows(trace_of(lambda t: 9.0, here(1.8), valid=lambda t: t < 2.0))
    assert not gone.seen.any()
    assert np.isfinite(gone.left[0, 1]) and np.isinf(gone.left[30, 1])


def test_a_vehicle_has_left_recently_from_when_it_leaves_until_the_prediction_is_over():
    trace = trace_of(lambda t: 4.8 if 0.55 < t < 0.65 else 1.8, here(1.8))
    left = left_recently(trace, find_windows(trace))
    assert left.shape == (51, 2) and not left[:, 0].any()
    assert np.flatnonzero(left[:, 1]).tolist() == list(
        range(6, 32)
    )  # left at 0.6 s what was predicted at 0.1 s for 3 s
    gone = trace_of(lambda t: 9.0, here(1.8), valid=lambda t: t < 2.0)
    assert np.flatnonzero(left_recently(gone, find_windows(gone))[:, 1]).tolist() == list(range(5, 20))


def test_a_collision_is_a_planning_failure_unless_the_partner_left_its_set_shortly_before():
    hit = Outcome(Kind.FRONTAL, 5.0, 1, Fault.EGO)

    def cause(lat):
        return cause_of(trace_of(lat, here(1.8), outcome=hit))

    assert cause(lambda t: 1.8) is Cause.PLANNING
    assert cause(lambda t: 4.8 if t > 4.6 else 1.8) is Cause.PREDICTION
    assert cause(lambda t: 4.8 if 0.5 < t < 1.0 else 1.8) is Cause.PLANNING  # long before
    finished = trace_of(lambda t: 9.0, here(1.8))
    assert cause_of(finished) is Cause.NONE


def test_a_collision_after_which_no_plan_was_ever_clear_comes_of_its_start():
    hit = trace_of(lambda t: 1.8, here(1.8), outcome=Outcome(Kind.FRONTAL, 5.0, 1, Fault.EGO))
    unclear = tuple(replace(plan, status=Status.UNSAFE) for plan in hit.plans)
    assert cause_of(replace(hit, plans=unclear)) is Cause.START
    unknown = tuple(replace(plan, status=Status.INVALID_INPUT) for plan in hit.plans)  # of who plans nothing
    for plans in ((*hit.plans[:1], *unclear[1:]), unknown):
        assert cause_of(replace(hit, plans=plans)) is Cause.PLANNING


def test_who_is_in_the_box_but_not_in_the_tube_was_planned_against():
    hit = Outcome(Kind.FRONTAL, 5.0, 1, Fault.EGO)
    corner = trace_of(lambda t: 1.8 + 0.9, lambda k: paths_of(1.8, start=50.0 + 2.0 * k - 0.9), outcome=hit)
    assert find_windows(corner).missed[:, 1].any()
    assert not find_windows(corner, boxes=True).missed.any()
    assert cause_of(corner) is Cause.PLANNING


def test_a_body_that_is_turned_out_of_its_box_is_missed():
    def turned(heading):
        trace = trace_of(lambda t: 1.8, here(1.8, tube=0.5))
        trace.scene.heading[:, 1] = heading
        return trace

    corner = np.arcsin(0.5 / 2.4)  # by which the length alone reaches the edge of the box
    assert not find_windows(turned(0.9 * corner)).missed.any()
    for sign in (-1.0, 1.0):
        assert find_windows(turned(sign * 1.1 * corner)).missed[:21, 1].all()
        assert find_windows(turned(sign * 1.1 * corner), boxes=True).missed[:21, 1].all()


@pytest.mark.parametrize("share", [0.97, 1.03])
@pytest.mark.parametrize("cut", [False, True])
def test_curved_paths_have_the_certified_tube(share, cut):
    """Vehicles at 97 % and 103 % of the radius of the tubes that a predictor hands out, whole or cut to a box."""
    times = DT * np.arange(HORIZON + 1)
    bases = FakeBasis.make((0.0, -3.0), (0.0, 3.6))
    deviation, rate = bases.rollout(times)
    size = np.array([[2.4, 0.95]])
    reach = 0.75 * Basis(np.zeros((1, 7, 2)), radius=0.75, aspect=4.0, growth=1.0, step=0.5).tolerance(0.75, times)
    basis = Basis(np.zeros((1, 7, 2)), radius=0.75, aspect=4.0, growth=1.0, step=0.5, reach=reach if cut else None)
    tube, ellipse = 0.75 * basis.tube(times), basis.tolerance(0.75, times)
    for base in range(4):
        state = np.array([50.0, 5.4, 20.0, 0.0])
        motion = follow(state, times, deviation[base], rate[base])
        half_sizes = turned_half_extents(size, motion[:, 3]) + tube
        paths = PredictedPaths(motion[None, :, :2], np.array([1]), half_sizes[None], DT, ellipse[None])
        fine = 0.1 * np.arange(31)
        for angle in np.linspace(0, 2 * np.pi, 8):
            path = follow(state, fine, *(part[base] for part in bases.rollout(fine)))[:, :2]
            direction = np.array([np.cos(angle), np.sin(angle)])
            offset = basis.tolerance(0.75, fine) * direction
            offset *= np.minimum(1.0, (0.75 * basis.tube(fine) / np.maximum(np.abs(offset), 1e-9)).min(-1))[:, None]
            actual = path + share * offset
            scenes = [make_scene([0.0, lon], [1.8, lat]) for lon, lat in actual]
            plan = ConstantPlanner().plan(np.zeros(4), paths, Road.straight())
            steps = [Step(Decision(paths, plan), TrafficStep.without_bases(scene)) for scene in scenes[1:]]
            trace = make_trace(scenes[0], Road.straight(), steps, 0.1)
            assert find_windows(trace).missed[0, 1] == (share > 1)
