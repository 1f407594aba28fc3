"""The long-run average is held whatever happens; windows are settled as the evaluation finds them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulation_fakes import ConstantPlanner

from coverdrive.dialling.adapting import life
from coverdrive.driving.driver import Driver
from coverdrive.errors import SettingError
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.adaptive import Adaptive, LongRun, near
from coverdrive.prediction.fit import Fit
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.measures.misses import find_windows
from coverdrive.simulation.studies.setup import Setup

BOXES = ConstantVelocity(np.array([[1.0, 0.2], [2.0, 0.4], [4.0, 0.8]]))
ROAD = Road.straight()
ALWAYS = math.inf
"""scale that a window needs which no set holds"""


def long_run(rate: float = 0.05, start: float = 0.0) -> LongRun:
    return LongRun(0.1, rate, 0.1, 10.0, first=start, level=start)


def driven(run: LongRun, needed: list[tuple[float, int]]) -> int:
    """A window each moment that needs a scale, and is settled so many moments later; the largest sets' losses."""
    under_way, beyond = list[tuple[int, bool, bool]](), 0
    for now, (scale, delay) in enumerate([*needed, *[(0.0, 0)] * 60]):
        over = [each for each in under_way if each[0] <= now]
        under_way = [each for each in under_way if each[0] > now]
        run.settle(sum(lost for _, lost, _ in over), len(over))
        beyond += sum(lost and largest for _, lost, largest in over)
        if now < len(needed):
            under_way.append((now + 1 + delay, scale > run.scale, run.scale == run.largest))
            run.most = max(run.most, len(under_way))
        assert run.smallest * (1 - 1e-12) <= run.scale <= run.largest
    return beyond


WINDOWS = st.lists(
    st.tuples(st.one_of(st.sampled_from([0.0, 1.0, 9.9, 10.0, ALWAYS]), st.floats(0.0, 12.0)), st.integers(0, 30)),
    min_size=1,
    max_size=400,
)


@given(WINDOWS, st.sampled_from([0.005, 0.05, 0.5]), st.integers(1, 4))
def test_no_traffic_and_no_delays_break_the_bound(windows: list[tuple[float, int]], rate: float, times: int) -> None:
    run = long_run(rate)
    beyond = driven(run, windows * times)
    assert run.settled == len(windows) * times
    worst = run.missed + (math.log(10) / rate + 0.9 * (run.most + beyond)) / run.settled
    assert run.lost / run.settled <= worst + 1e-9
    assert run.bound == pytest.approx(min(1.0, worst - 0.9 * beyond / run.settled))


@given(st.lists(st.tuples(st.floats(0.2, 9.0), st.integers(0, 30)), min_size=100, max_size=300))
def test_it_is_no_more_careful_than_it_has_to_be(windows: list[tuple[float, int]]) -> None:
    run = long_run()
    driven(run, windows)
    least = run.missed - math.log(10) / (run.rate * run.settled)
    assert run.lost / run.settled >= least - 1e-9  # every window needs more than the floor


def test_who_answers_losses_with_smaller_sets_or_not_at_all_breaks_it() -> None:
    """Traffic changes midway; the same windows for all."""
    random = np.random.default_rng(0)
    needs = np.concatenate([random.lognormal(mean, 0.5, 4000) for mean in (0.0, 0.8, 0.0)])
    windows = [(float(each), 30) for each in needs]
    right, reversed_, deaf = long_run(), long_run(-0.05), long_run(1e-9)
    for run in (right, reversed_, deaf):
        driven(run, windows)
    allowed = right.bound
    assert allowed < 0.12
    assert right.lost / right.settled == pytest.approx(0.1, abs=0.005)
    assert reversed_.lost / reversed_.settled > 0.5 > allowed
    assert deaf.lost / deaf.settled > 0.5 > allowed


def scene_of(lat: float, moment: int, speed: float = 20.0) -> Scene:
    """The ego, and a vehicle 20 m ahead, both at constant speed for so many steps of 0.1 s."""
    lon = np.array([0.0, 20.0]) + 0.1 * speed * moment
    ones = np.ones(2)
    return Scene(lon, np.array([1.8, lat]), speed * ones, 0 * ones, 4.8 * ones, 1.9 * ones, ones > 0)


def asked(belief: Adaptive, scene: Scene) -> tuple[int, int]:
    belief.predict(scene, ROAD, 0, 0.1, 30)
    return belief.run.settled, belief.run.lost


def test_a_vehicle_that_leaves_its_box_after_some_time_is_lost_then_and_kept_windows_take_the_whole_horizon() -> None:
    belief = Adaptive(BOXES)
    for k in range(12):
        assert asked(belief, scene_of(1.8, k)) == (0, 0)
    assert asked(belief, scene_of(3.0, 12)) == (12, 12)  # 1.2 m aside, beyond the box of any window before
    level = belief.run.level
    assert level == pytest.approx(12 * 0.9 * belief.rate)
    for k in range(13, 42):
        assert asked(belief, scene_of(3.0, k)) == (12, 12)
    assert asked(belief, scene_of(3.0, 42)) == (13, 12)
    assert belief.run.level == pytest.approx(level - 0.1 * belief.rate)
    assert belief.run.most == 30


def test_windows_that_are_cut_off_are_not_counted() -> None:
    belief = Adaptive(BOXES)
    for k in range(20):
        asked(belief, scene_of(1.8, k))
    assert asked(belief, scene_of(3.4, 0)) == (0, 0)  # the ego is where it began: another drive
    for k in range(1, 20):
        asked(belief, scene_of(3.4, k))
    jumped = scene_of(3.4, 20)
    jumped.lon[1] += 10.0  # another vehicle in the slot of the one before
    assert asked(belief, jumped) == (0, 0)
    gone = scene_of(3.4, 21)
    gone.valid[1] = False
    for k in range(22, 60):
        assert asked(belief, replace(scene_of(3.4, k), valid=gone.valid)) == (0, 0)
    assert belief.scale == 1.0


def test_the_same_scene_again_is_the_same_moment() -> None:
    once, twice = Adaptive(BOXES), Adaptive(BOXES)
    for k in range(40):
        scene = scene_of(1.8, k)
        asked(once, scene)
        asked(twice, scene)
        asked(twice, scene)
    assert once.kept == twice.kept and once.run.settled == 10


def test_a_fitted_predictor_is_asked_at_the_present_scale_and_compiled_once(fitted: Fit) -> None:
    predictor, scene = fitted.predictor, scene_of(1.8, 0)
    paths = Adaptive(predictor, start=0.5).predict(scene, ROAD, 0, 0.25, 12)
    smaller = predictor.scaled(0.5)
    assert np.array_equal(paths.half_sizes, smaller.predict(scene, ROAD, 0, 0.25, 12).half_sizes)
    assert not np.array_equal(paths.half_sizes, predictor.predict(scene, ROAD, 0, 0.25, 12).half_sizes)
    assert smaller._values is predictor._values  # pyright: ignore[reportPrivateUsage]


def test_near_is_within_50_m_and_a_lane() -> None:
    n = 6
    lon, lat = np.array([100.0, 149.0, 51.0, 151.0, 100.0, 100.0]), np.array([1.8, 1.8, 5.4, 1.8, 9.0, 5.4])
    valid = np.array([True] * 5 + [False])
    scene = Scene(lon, lat, np.ones(n), np.zeros(n), np.ones(n), np.ones(n), valid)
    assert near(scene, ROAD, 0).tolist() == [False, True, True, False, False, False]


def setup_of(belief: object, seconds: float = 4.0) -> Setup:
    return Setup(belief, ConstantPlanner, "drivers", EpisodeSettings(duration=seconds), (6, 8), seed=3)  # pyright: ignore


class Ellipses(ConstantVelocity):
    """The same boxes, in which the centre has to stay in an ellipse besides, at the points of a path alone."""

    def predict(self, scene: Scene, *asked) -> PredictedPaths:
        paths = super().predict(scene, *asked)
        return replace(paths, ellipses=np.maximum(paths.half_sizes - scene.half_sizes[paths.vehicle, None], 0.01))


@pytest.mark.parametrize("kind", [ConstantVelocity, Ellipses])
def test_windows_are_those_that_the_evaluation_finds(kind: type[ConstantVelocity]) -> None:
    """In steps of 0.1 s: of boxes in every one, with ellipses at the points of a path, 0.25 s apart."""
    belief = Adaptive(kind(BOXES.beyond), rate=1e-6)
    settled = lost = 0
    for trial in range(4):
        setup = setup_of(belief)
        seed = np.random.SeedSequence(3, spawn_key=(trial,))
        trace = run_episode(*setup.participants(), setup.episode, 6, seed)
        last = Scene(*(np.asarray(each)[-1] for each in vars(trace.scene).values()))
        belief.predict(last, trace.road, 0, 0.25, 12)  # which sees how the drive ended
        windows, beside = find_windows(trace), near(trace.scene, trace.road, 0)[:-1]
        settled += int(((windows.seen | np.isfinite(windows.left)) & beside).sum())
        lost += int((np.isfinite(windows.left) & beside).sum())
    assert (belief.run.settled, belief.run.lost) == (settled, lost)
    assert 0 < lost < settled


def test_an_average_with_other_options_is_a_new_one() -> None:
    belief = Adaptive(BOXES, missed=0.3, rate=0.02, start=0.2)
    belief.run.settle(lost=300, settled=1000)
    assert Adaptive(BOXES, missed=0.3, rate=0.02, state=belief.kept).run == belief.run
    for options in ({"missed": 0.05}, {"rate": 0.5}, {"smallest": 1.0}, {"largest": 5.0}):
        other = Adaptive(BOXES, **{"missed": 0.3, "rate": 0.02} | options, state=belief.kept)
        assert (other.run.settled, other.run.lost) == (0, 0) and other.run.bound == 1.0
        assert other.scale == pytest.approx(max(belief.scale, other.smallest))


def test_a_life_remembers_and_can_be_lived_again_from_what_was_kept() -> None:
    belief = Adaptive(BOXES, rate=0.02)
    before = life(setup_of(belief), 3)
    kept = json.loads(json.dumps(belief.kept))
    after = life(setup_of(belief), 2, first=3)
    assert before["scale"].n_unique() == 3 and before["near"].sum() > 0
    assert (before["bound"] > 0.1).all()
    again = life(setup_of(Adaptive(BOXES, rate=0.02, state=kept)), 2, first=3)
    timed = [name for name in after.columns if "planning" in name]
    assert again.drop(timed).equals(after.drop(timed))
    fixed = life(setup_of(BOXES), 3)
    assert fixed["near"].equals(before["near"])  # nobody plans by it here
    assert fixed["scale"].null_count() == 3


def test_a_trial_begins_with_what_is_known_whatever_the_smallest_sets_are() -> None:
    belief = Adaptive(BOXES, smallest=2.0, start=3.0)
    assert belief.anew().kept == belief.kept


def test_trials_of_a_study_do_not_depend_on_each_other() -> None:
    belief = Adaptive(BOXES, rate=0.05)
    setup = setup_of(belief)
    participants, known = setup.participants(), belief.kept
    alone = setup.row(2, setup.participants())
    for trial in range(2):
        setup.row(trial, participants)
    after = setup.row(2, participants)
    same = [name for name in alone if "planning" not in name]
    assert [alone[name] for name in same] == [after[name] for name in same]
    assert belief.kept == known
    fingerprint = setup.description()["predictor"]
    life(setup, 1)
    assert setup.description()["predictor"] != fingerprint


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"missed": 0.0}, "share missed between 0 and 1"),
        ({"rate": 2.0}, "a rate"),
        ({"smallest": 2.0}, "0 < smallest ≤ start ≤ largest"),
        ({"largest": 1000.0}, "largest ≤ 100"),
        ({"state": {"level": 0.0}}, "as `kept` gives them"),
    ],
)
def test_what_makes_no_sense_is_refused(wrong: dict, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        Adaptive(BOXES, **wrong)


def test_a_belief_without_a_scale_and_another_period_are_refused() -> None:
    with pytest.raises(SettingError, match="has no scaled"):
        Adaptive(object())
    with pytest.raises(SettingError, match=r"asked every 0.1 s"):
        life(setup_of(Adaptive(BOXES, period=0.2)), 1)
    with pytest.raises(SettingError, match=r"learns every 0.1 s, but is asked every 0.2 s"):
        Driver(Adaptive(BOXES), period=0.2)
