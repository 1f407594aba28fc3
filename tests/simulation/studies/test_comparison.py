import shutil

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ttest_rel
from simulation_fakes import REPLAYED, ConstantPlanner, fakes

from coverdrive.errors import CertificateError, DataError
from coverdrive.simulation.studies.comparison import compare, mean_interval, newcombe_interval, paired_t
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.study import Study

pytestmark = pytest.mark.usefixtures("uncollected")


def pairs(both: int, first: int, second: int, neither: int) -> tuple[np.ndarray, np.ndarray]:
    counts = [both, first, second, neither]
    return np.repeat([True, True, False, False], counts), np.repeat([True, False, True, False], counts)


def test_newcombe_interval_of_a_published_example():
    """Fagerland, Lydersen & Laake, *Statistical Analysis of Contingency Tables*, 2017, table 8.1 (Bentur et al.)."""
    low, high = newcombe_interval(*pairs(1, 1, 7, 12), 0.95)
    assert (round(low, 3), round(high, 3)) == (0.026, 0.507)


@given(*[st.integers(0, 40)] * 4)
def test_newcombe_interval_contains_the_difference_and_turns_with_the_studies(both, first, second, neither):
    if both + first + second + neither == 0:
        return
    one, two = pairs(both, first, second, neither)
    low, high = newcombe_interval(one, two, 0.95)
    assert -1 - 1e-9 <= low <= two.mean() - one.mean() <= high <= 1 + 1e-9
    assert newcombe_interval(two, one, 0.95) == pytest.approx((-high, -low))


def test_newcombe_interval_of_many_trials():
    first = np.arange(200_000) % 2 == 0
    low, high = newcombe_interval(first, ~first, 0.95)
    assert low < 0 < high and high - low == pytest.approx(2 * 1.96 / np.sqrt(200_000), rel=0.01)


@pytest.mark.slow
def test_newcombe_interval_covers_as_often_as_it_says():
    random = np.random.default_rng(0)
    cells = random.multinomial(200, [0.02, 0.05, 0.08, 0.85], 2000)
    intervals = np.array([newcombe_interval(*pairs(*row), 0.95) for row in cells])
    covered = ((intervals[:, 0] <= 0.03) & (intervals[:, 1] >= 0.03)).mean()
    assert 0.93 < covered < 0.98


def test_paired_t_agrees_with_scipy():
    random = np.random.default_rng(1)
    one, two = random.normal(20, 2, (2, 30))
    result = ttest_rel(two, one)
    interval = result.confidence_interval(0.9)
    assert paired_t(two - one, 0.9) == pytest.approx((interval.low, interval.high, result.pvalue))


@pytest.mark.parametrize("difference", [np.ones(2), np.full(3, 0.1), np.array([2.3, 1.4]) - [1.2, 0.3]])
def test_differences_that_are_all_equal_have_no_interval(difference):
    assert np.isnan(paired_t(difference, 0.95)).all()
    assert mean_interval(difference, 0.95) == mean_interval(difference[:0], 0.95) == (None, None)


def test_who_never_differs_has_no_interval_but_a_p():
    low, high, p = paired_t(np.zeros(4), 0.9)
    assert np.isnan([low, high]).all() and p == 1.0


@pytest.mark.slow
def test_of_pairs_of_which_few_differ_the_p_holds_and_the_interval_only_if_they_differ_both_ways():
    """Differences in one direction alone are the negative control: the interval is said not to hold there."""
    random = np.random.default_rng(0)
    for pairs_ in (10, 40, 100):
        differ = random.random((2000, pairs_)) < 0.1
        amounts = differ * random.normal(size=differ.shape)
        both_ways = np.array([paired_t(each, 0.95) for each in amounts])
        one_way = np.array([paired_t(each, 0.95) for each in differ * random.exponential(size=differ.shape)])
        assert (both_ways[:, 2] < 0.05).mean() < 0.06
        assert ((both_ways[:, 0] > 0) | (both_ways[:, 1] < 0)).mean() < 0.06
        assert (one_way[:, 1] < 0.1).mean() > 0.08


def accelerating():
    return ConstantPlanner(1.0)


def test_two_planners_in_the_same_traffic(tmp_path):
    first = Study(fakes(), tmp_path / "a" / "study").run(5)
    Study(fakes(accelerating), tmp_path / "b").run(4)
    found = compare(tmp_path / "a", tmp_path / "b")
    assert found.trials == 4
    assert found.settings["planner.name"] == ("simulation_fakes.ConstantPlanner", f"{__name__}.accelerating")
    assert set(found.settings) == {"planner.name", "planner.code"}
    speed = found.measures[0]
    assert (speed.name, speed.pairs) == ("mean_speed", 4)
    assert speed.first == pytest.approx(20.0) and speed.second == pytest.approx(20.5, abs=0.1)
    assert np.isnan([speed.low, speed.high, speed.p]).all()  # who accelerates alike is faster alike
    headway = next(each for each in found.measures if each.name == "usual_headway")
    assert headway.low <= headway.value <= headway.high < 0 and headway.p < 0.01
    assert compare(first, tmp_path / "a").measures[0].p == 1.0


@pytest.mark.parametrize("traffic", ["replay", "reactive-replay"])
def test_replays_differ_without_interval_or_test(tmp_path, traffic):
    for name, planner in (("a", ConstantPlanner), ("b", accelerating)):
        Study(fakes(planner, **REPLAYED | {"traffic": traffic}), tmp_path / name).run(4)
    found = compare(tmp_path / "a", tmp_path / "b")
    assert found.replayed and found.collisions[0].only is not None
    headway = next(each for each in found.measures if each.name == "usual_headway")
    assert headway.pairs > 1 and headway.value != 0
    for each in (*found.collisions, *found.measures):
        assert np.isnan([each.low, each.high, each.p]).all()


def test_one_pair_has_means_but_no_interval(tmp_path):
    Study(fakes(), tmp_path).run(1)
    speed = compare(tmp_path, tmp_path).measures[0]
    assert (speed.pairs, speed.first, speed.value) == (1, pytest.approx(20.0), 0.0)
    assert np.isnan([speed.low, speed.high, speed.p]).all()


def test_collisions_are_compared_by_the_trials_in_which_only_one_collided(tmp_path):
    kinds = {"a": ["side"] * 6 + ["finished"] * 4, "b": ["finished"] * 5 + ["side"] + ["finished"] * 3 + ["side"]}
    once = Study(fakes(), tmp_path / "a").run(1).trials
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    for name, ends in kinds.items():
        StudyFolder(tmp_path / name).save_table(pl.concat([once] * 10).with_columns(kind=pl.Series(ends)))
    side, rear = compare(tmp_path / "a", tmp_path / "b").collisions
    assert side.only == (5, 1)
    assert side.p == pytest.approx(2 * (1 + 6) / 2**6)
    assert (rear.only, rear.p, rear.value) == ((0, 0), 1.0, 0.0)


def test_other_seeds_or_vehicles_are_refused(tmp_path):
    Study(fakes(), tmp_path / "a").run(2)
    Study(fakes(seed=1), tmp_path / "b").run(1)
    Study(fakes(vehicles=(3, 6)), tmp_path / "c").run(2)
    with pytest.raises(DataError, match="seeds differ"):
        compare(tmp_path / "a", tmp_path / "b")
    with pytest.raises(DataError, match=r"numbers of vehicles differ: trial 1 has 4 and 6"):
        compare(tmp_path / "a", tmp_path / "c")


@pytest.mark.parametrize("confidence", [0.0, 1.0, 2.0, float("nan")])
def test_confidences_that_are_none_are_refused(tmp_path, confidence):
    Study(fakes(), tmp_path / "a").run(2)
    with pytest.raises(CertificateError, match="confidence"):
        compare(tmp_path / "a", tmp_path / "a", confidence)


def test_studies_of_which_no_trial_started_in_both_are_refused(tmp_path):
    once = Study(fakes(), tmp_path / "a").run(2).trials
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    for name, reasons in {"a": ["", "no room"], "b": ["no room", ""]}.items():
        kinds = ["not started" if reason else "finished" for reason in reasons]
        rows = once.with_columns(kind=pl.Series(kinds), reason=pl.Series(reasons))
        StudyFolder(tmp_path / name).save_table(rows)
    with pytest.raises(DataError, match=r"of 2 trials that .* none started in both"):
        compare(tmp_path / "a", tmp_path / "b")


def test_what_is_missing_in_a_folder_is_named(tmp_path):
    Study(fakes(), tmp_path / "a").run(1)
    Study(fakes(), tmp_path / "b" / "study").run(1)
    (tmp_path / "empty").mkdir()

    def complaint(folder):
        with pytest.raises(DataError) as caught:
            compare(tmp_path / "a", folder)
        assert "Errno" not in str(caught.value)
        return str(caught.value)

    for name in ("nothing", "empty"):
        assert f"{tmp_path / name} holds no study" in complaint(tmp_path / name)
    (tmp_path / "b" / "study" / "trials.parquet").write_text("torn")
    assert "trials.parquet is damaged or of another version" in complaint(tmp_path / "b")
    (tmp_path / "b" / "study" / "trials.parquet").unlink()
    assert f"the study in {tmp_path / 'b' / 'study'} is not finished" in complaint(tmp_path / "b")
