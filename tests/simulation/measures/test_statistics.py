import numpy as np
import polars as pl
import pytest

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.simulation.measures.statistics import braking_behind, collision_table, miss_rate, widest_interval


def results(kinds_by_vehicles):
    rows = [(vehicles, kind) for vehicles, kinds in kinds_by_vehicles.items() for kind in kinds]
    return pl.DataFrame(rows, schema=["vehicles", "kind"], orient="row")


def test_the_papers_result_and_its_intervals():
    kinds = ["frontal"] * 3 + ["side"] * 4 + ["rear-end"] * 20 + ["finished"] * 973
    table = collision_table(results({3: kinds[:200], 4: kinds[200:400], 5: kinds[400:]}))
    total = table.row(-1, named=True)
    assert total["vehicles"] is None
    assert (total["trials"], total["frontal_or_side"], total["rear_end"]) == (1000, 7, 20)
    assert total["frontal_or_side_rate"] == pytest.approx(0.007)
    assert [round(100 * total[f"frontal_or_side_{end}"], 2) for end in ("low", "high")] == [0.28, 1.44]
    assert [round(100 * total[f"rear_end_{end}"], 2) for end in ("low", "high")] == [1.23, 3.07]


def test_rows_are_by_number_of_vehicles_and_add_up():
    table = collision_table(results({7: ["side", "finished"], 3: ["rear-end", "frontal", "finished"]}))
    assert table["vehicles"].to_list() == [3, 7, None]
    assert table["trials"].to_list() == [3, 2, 5]
    assert table["frontal_or_side"].to_list() == [1, 1, 2]
    assert table["rear_end"].to_list() == [1, 0, 1]


def test_no_collision_still_has_an_upper_end():
    total = collision_table(results({3: ["finished"] * 100})).row(-1, named=True)
    assert total["frontal_or_side_low"] == 0
    assert total["frontal_or_side_high"] == pytest.approx(1 - 0.025 ** (1 / 100))


def test_a_study_is_as_uncertain_as_its_wider_interval():
    some = results({3: ["side"] * 5 + ["finished"] * 95})
    total = collision_table(some).row(-1, named=True)
    assert widest_interval(some) == total["frontal_or_side_high"] - total["frontal_or_side_low"]
    assert total["rear_end_high"] < widest_interval(some)


def misses(missed, total):
    return pl.DataFrame({"missed": missed, "total": total})


def test_miss_rate_is_over_all_and_its_interval_over_trials():
    alike = miss_rate(misses([1] * 50, [10] * 50), "missed", "total")
    assert (alike.count, alike.total) == (50, 500)
    weight = 0.025 ** (1 / 50)  # of 50 trials against one more: trials are counted
    assert (alike.low, alike.high) == pytest.approx((0.1 * weight, 1 - 0.9 * weight))
    bunched = miss_rate(misses([10] * 5 + [0] * 45, [10] * 50), "missed", "total")
    assert bunched.count == 50
    assert (bunched.low, bunched.high) == pytest.approx(clopper_pearson(5, 50), abs=0.006)


def test_no_miss_still_has_an_upper_end_and_one_trial_says_nothing():
    assert miss_rate(misses([0] * 20, [100] * 20), "missed", "total").high == pytest.approx(1 - 0.025 ** (1 / 20))
    assert miss_rate(misses([3], [100]), "missed", "total").low == 0.0
    assert miss_rate(misses([3], [100]), "missed", "total").high == 1.0
    assert miss_rate(misses([0] * 20 + [0] * 5, [100] * 20 + [0] * 5), "missed", "total").high == pytest.approx(
        1 - 0.025 ** (1 / 20)
    )


def coverage(trials: int, low: float, high: float) -> tuple[float, float]:
    """How often the interval holds the rate 0.1 of trials that differ by a beta distribution, and is above it."""
    random = np.random.default_rng(0)
    covered, above = 0, 0
    for _ in range(1000):
        table = misses(random.binomial(100, random.beta(low, high, trials)), np.full(trials, 100))
        rate = miss_rate(table, "missed", "total")
        covered += rate.low <= 0.1 <= rate.high
        above += rate.low > 0.1
    return covered / 1000, above / 1000


@pytest.mark.slow
def test_the_interval_of_a_miss_rate_covers_as_often_as_it_says():
    covered, _ = coverage(300, 0.2, 1.8)  # few have most of what is missed
    assert 0.92 < covered < 0.98


@pytest.mark.slow
def test_where_trials_are_few_and_differ_little_it_covers_more_often():
    covered, above = coverage(40, 2.0, 18.0)
    assert 0.92 < covered < 0.995 and 0.002 < above < 0.04


def test_braking_behind_is_of_the_median_trial_and_of_one_in_twenty():
    table = pl.DataFrame({"hardest_braking_behind": [*map(float, range(21)), None]})
    assert braking_behind(table) == (10.0, 19.0)
    assert braking_behind(table.tail(1)) is None


def test_replays_which_depend_on_each_other_have_counts_alone():
    table = collision_table(results({3: ["side", "finished"], 4: ["finished"] * 2}), replayed=True)
    assert table["frontal_or_side"].to_list() == [1, 0, 1] and table["frontal_or_side_rate"].to_list() == [0.5, 0, 0.25]
    for end in ("frontal_or_side_low", "frontal_or_side_high", "rear_end_low", "rear_end_high"):
        assert table[end].dtype == pl.Float64 and table[end].null_count() == 3
    rate = miss_rate(misses([1] * 50, [10] * 50), "missed", "total", replayed=True)
    assert (str(rate), rate.brief) == ("10 % (50 of 500)", "10 %")
