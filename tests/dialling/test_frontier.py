"""How many drives tell two rates apart: by hand, and by simulation with the very criterion."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, norm
from simulation_fakes import FakeBasis, FakePredictor

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.dialling.frontier import POWER, drives_to_tell, frontier, told_apart


def apart(first: int, second: int, drives: int) -> bool:
    one, other = sorted((first, second))
    return clopper_pearson(one, drives)[1] < clopper_pearson(other, drives)[0]


class Sized(FakePredictor):
    certificate = None

    def scaled(self, scale):
        return self


@pytest.mark.slow
def test_who_stops_when_an_interval_excludes_the_truth_needs_one_that_holds_at_any_time() -> None:
    """The negative control are Clopper and Pearson's intervals of the same drives."""
    random, rate, looks = np.random.default_rng(0), 0.3, range(10, 401, 5)
    outside = {False: 0, True: 0}
    for _ in range(100):
        hits = random.random(400) < rate
        stop = next((n for n in looks if clopper_pearson(int(hits[:n].sum()), n)[1] < rate), 400)
        rows = {"kind": np.where(hits[:stop], "side", "finished"), "at_fault": "none", "mean_speed": 20.0}
        table = pl.DataFrame(rows | {"share_unsafe": 0.0, "usual_headway": 1.0, "time": 20.0})
        for anytime in outside:
            line = frontier({("proof", "somebody", None): table}, Sized(FakeBasis.make()), anytime).row(0, named=True)
            outside[anytime] += not line["rate_low"] <= rate <= line["rate_high"]
    assert outside[True] <= 5 and outside[False] > 12


def test_the_unsafe_plans_of_a_drive_that_ended_early_count_for_as_many_as_they_are() -> None:
    rows = {"kind": ["finished", "side"], "at_fault": ["none", "other"], "mean_speed": 20.0, "usual_headway": 1.0}
    table = pl.DataFrame(rows | {"time": [20.0, 5.0], "share_unsafe": [0.0, 0.5]})
    line = frontier({("pilot", "somebody", None): table}, Sized(FakeBasis.make()), False).row(0, named=True)
    assert line["share_unsafe"] == pytest.approx(0.5 * 5 / 25) and line["collisions"] == 1


def test_who_is_told_apart_needs_none_and_who_is_alike_has_no_number() -> None:
    assert drives_to_tell((0, 100), (20, 100)) == drives_to_tell((20, 100), (0, 100)) == 0
    assert drives_to_tell((3, 100), (3, 100)) is drives_to_tell((3, 100), (6, 200)) is None


def test_never_against_always_by_hand() -> None:
    """The upper end of none, 1 − 0.025^(1/n), is below 1/2 from six drives on."""
    assert not apart(0, 5, 5) and apart(0, 6, 6)
    assert [told_apart(drives, 0.0, 1.0) for drives in (1, 5, 6)] == pytest.approx([0, 0, 1])


@given(st.integers(1, 60), st.integers(0, 40), st.integers(1, 60))
def test_the_probability_is_that_of_all_pairs_of_counts(drives: int, percent: int, more: int) -> None:
    rate, higher = percent / 100, (percent + more) / 100
    counts = np.arange(drives + 1)
    few, many = (binom.pmf(counts, drives, each) for each in (rate, higher))
    low, high = np.array([clopper_pearson(k, drives) for k in range(drives + 1)]).T
    pairs = high[:, None] < low
    assert told_apart(drives, rate, higher) == pytest.approx(few @ pairs @ many, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [((1, 100), (5, 100)), ((0, 100), (3, 100)), ((2, 1000), (8, 1000))])
def test_so_many_drives_tell_as_often_as_is_said_and_those_of_a_normal_test_do_not(
    first: tuple[int, int], second: tuple[int, int]
) -> None:
    """The negative control is the size for a test of two rates at 5 %, which is less strict than the intervals."""
    random, rates = np.random.default_rng(0), np.array([first[0] / first[1], second[0] / second[1]])

    def share(drives: int) -> float:
        pairs = random.binomial(drives, rates, (1000, 2)).tolist()
        return float(np.mean([apart(one, other, drives) for one, other in pairs]))

    needed = drives_to_tell(second, first)
    assert needed is not None and abs(share(needed) - POWER) < 0.04
    normal = (norm.ppf(0.975) + norm.ppf(POWER)) ** 2 * (rates * (1 - rates)).sum() / np.diff(rates)[0] ** 2
    assert share(int(normal)) < 0.55


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drives", "rate", "limit"),
    [(100, 0.02, 0.09), (100, 0.1, 0.09), (1000, 0.01, 0.09), (100, 0.5, 0.09), (1000, 0.5, 0.12)],
)
def test_of_eight_that_are_alike_the_extremes_are_seldom_told_apart(drives: int, rate: float, limit: float) -> None:
    """The negative control is a normal test of two rates at 5 %, which tells half of them apart."""
    counts = np.random.default_rng(0).binomial(drives, rate, (1000, 8))
    least, most = counts.min(1), counts.max(1)
    mean = (least + most) / (2 * drives)
    tested = (most - least) / drives > 1.96 * np.sqrt(2 * mean * (1 - mean) / drives)
    assert np.mean([apart(*each, drives) for each in zip(least.tolist(), most.tolist(), strict=True)]) < limit
    assert tested.mean() > 0.4


@pytest.mark.slow
def test_on_equal_seeds_they_tell_more_often() -> None:
    """Who collides at the lower rate collides at the higher one, too, in half of the cases."""
    random, drives = np.random.default_rng(0), drives_to_tell((5, 100), (10, 100))
    assert drives is not None
    cells = random.multinomial(drives, [0.025, 0.025, 0.075, 0.875], 1000)
    told = [apart(int(both + one), int(both + other), drives) for both, one, other, _ in cells]
    assert np.mean(told) > POWER
