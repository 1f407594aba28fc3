"""The table of the league on hand-made drives."""

import numpy as np
import polars as pl
import pytest
from scipy.stats import t as student

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.league.problems import COLUMNS
from coverdrive.league.table import SCHEMA, league_table
from coverdrive.simulation.measures.trial import SCHEMA as MEASURED
from coverdrive.simulation.measures.trial import unstarted
from coverdrive.simulation.studies.comparison import newcombe_interval


def drives(speeds: list[float], collided: dict[int, tuple[str, str]] | None = None, **others: float) -> pl.DataFrame:
    """One row for each speed; collisions (kind, fault) by trial."""
    rows = []
    for trial, speed in enumerate(speeds):
        kind, fault = (collided or {}).get(trial, ("finished", "none"))
        row = unstarted(0, trial, 5, "") | {"kind": kind, "at_fault": fault, "mean_speed": speed, "share_unsafe": 0.1}
        row |= {"minimum_gap": 1.0 + trial, "jerk_longitudinal": 2.0, "planning_median": 0.004}
        rows.append(row | {"share_invalid_input": 0.0} | others)
    return pl.DataFrame(rows, schema=MEASURED)


def test_counts_means_and_paired_differences_are_those_by_hand() -> None:
    one, other = [20.0, 22.0, 24.0, 26.0], [21.0, 23.5, 24.5, 28.0]
    crashes = {1: ("frontal", "ego"), 2: ("rear-end", "other"), 3: ("side", "none")}
    table = league_table({("here", "first"): drives(one), ("here", "second"): drives(other, crashes)})
    assert table.schema == SCHEMA
    first, second = table.rows(named=True)
    assert (first["at_fault"], first["not_at_fault"], second["at_fault"], second["not_at_fault"]) == (0, 0, 1, 2)
    assert (second["at_fault_low"], second["at_fault_high"]) == clopper_pearson(1, 4, 0.95)
    assert (first["mean_speed"], second["mean_speed"], second["least_gap"]) == (23.0, 24.25, 1.0)
    assert first["mean_speed_minus"] is None
    difference = np.subtract(other, one)
    half = student.ppf(0.975, 3) * difference.std(ddof=1) / 2
    assert second["mean_speed_minus"] == pytest.approx(1.25)
    assert second["mean_speed_minus_low"] == pytest.approx(1.25 - half)
    assert second["mean_speed_minus_high"] == pytest.approx(1.25 + half)
    collided = np.array([False, True, False, False])
    assert second["at_fault_minus"] == 0.25
    ends = newcombe_interval(np.zeros(4, dtype=bool), collided, 0.95)
    assert (second["at_fault_minus_low"], second["at_fault_minus_high"]) == ends


def test_what_is_claimed_of_sets_stands_beside_those_who_have_some() -> None:
    driven = {("here", name): drives([20.0, 22.0]) for name in ("first", "second", "third")}
    claims = {("here", "first"): "share ≤ 10 % (99 %), λ 0.6", ("here", "second"): ""}
    assert league_table(driven, sets=claims)["sets"].to_list() == [claims["here", "first"], None, None]


def test_replays_have_counts_means_and_differences_without_intervals() -> None:
    collided = {1: ("frontal", "ego")}
    driven = {("here", "first"): drives([20.0, 22.0, 24.0]), ("here", "second"): drives([21.0, 23.5, 24.5], collided)}
    there = {("there", planner): table for (_, planner), table in driven.items()}
    table = league_table(driven | there, replayed=["there"])
    ends = [name for name in SCHEMA if name.endswith(("_low", "_high"))]
    here, replayed = (table.filter(pl.col("world") == world).drop("world") for world in ("here", "there"))
    assert here.equals(league_table(driven).drop("world"))
    assert replayed.drop(ends).equals(here.drop(ends)) and replayed.select(ends).null_count().row(0) == (2,) * len(ends)


def test_what_is_equal_in_all_drives_has_no_interval() -> None:
    table = league_table({("here", "first"): drives([20.0, 22.0]), ("here", "second"): drives([21.0, 23.0])})
    second = table.row(1, named=True)
    assert second["mean_speed_minus"] == 1.0 and second["jerk_longitudinal"] == 2.0
    for name in ("mean_speed_minus", "jerk_longitudinal", "jerk_longitudinal_minus"):
        assert second[f"{name}_low"] is second[f"{name}_high"] is None


def test_pairs_are_of_the_trials_that_both_could_start() -> None:
    late = pl.concat([pl.DataFrame([unstarted(0, 0, 5, "no room")], schema=MEASURED), drives([9.0, 23.0, 25.0])[1:]])
    table = league_table({("here", "first"): drives([20.0, 22.0, 24.0]), ("here", "second"): late})
    second = table.row(1, named=True)
    assert (second["drives"], second["mean_speed"], second["mean_speed_minus"]) == (2, 24.0, 1.0)


def problems(solved: list[bool], reasons: list[str], progress: list[float | None]) -> pl.DataFrame:
    """One row for each problem, of which nobody drove those without progress."""
    rows = []
    for trial, (done, reason, way) in enumerate(zip(solved, reasons, progress, strict=True)):
        row = unstarted(0, trial, 5, reason)
        if way is not None:
            kind = "frontal" if reason.startswith("collision (") else "finished"
            row |= {"kind": kind, "at_fault": "ego" if kind == "frontal" else "none", "mean_speed": 12.0}
        rows.append(row | {"solved": done, "off_road": reason == "off the road", "progress": way})
    return pl.DataFrame(rows, schema=COLUMNS)


def test_problems_that_nobody_could_drive_are_not_solved() -> None:
    reasons = ["collision (frontal)", "collision", "off the road", "not driven: no road"]
    one = problems([True] * 4, [""] * 4, [1.0] * 4)
    other = problems([False] * 4, reasons, [0.25, 0.5, 0.75, None])
    first, second = league_table({("here", "first"): one, ("here", "second"): other}).rows(named=True)
    assert (first["drives"], first["solved"], first["at_fault"], first["off_road"]) == (4, 4, 0, 0)
    assert (second["drives"], second["solved"], second["off_road"]) == (4, 0, 1)
    assert (second["at_fault"], second["not_at_fault"]) == (1, 1)  # what the judge alone saw is nobody's fault
    assert (first["solved_low"], first["solved_high"]) == clopper_pearson(4, 4, 0.95)
    ends = newcombe_interval(np.ones(4, dtype=bool), np.zeros(4, dtype=bool), 0.95)
    assert (second["solved_minus"], second["solved_minus_low"], second["solved_minus_high"]) == (-1.0, *ends)
    assert (second["progress"], second["progress_minus"]) == (0.5, -0.5)


def test_worlds_without_problems_have_none_solved() -> None:
    table = league_table({("here", "first"): drives([20.0, 22.0])})
    assert table.select("solved", "off_road", "progress", "solved_low").row(0) == (None,) * 4


def test_every_world_has_its_own_first() -> None:
    never = pl.DataFrame([unstarted(0, 0, 5, "no room")], schema=MEASURED)
    table = league_table({
        ("here", "first"): "does not apply", ("here", "second"): drives([20.0, 22.0]),
        ("there", "first"): drives([10.0, 12.0]), ("there", "second"): drives([11.0, 13.0]), ("there", "third"): never,
    })  # fmt: skip
    assert table["left_out"].to_list() == ["does not apply", None, None, None, "no room"]
    assert table["mean_speed_minus"].to_list() == [None, None, None, 1.0, None]
    assert table["drives"].to_list() == [0, 2, 2, 2, 0]


def test_what_is_not_known_is_left_out() -> None:
    agent = drives([20.0, 21.0], share_unsafe=0.0, share_invalid_input=1.0, planning_median=0.0)
    table = league_table({("here", "first"): drives([20.0, 22.0]), ("here", "agent"): agent})
    row = table.row(1, named=True)
    assert row["share_unsafe"] is None and row["planning_median"] is None and row["share_unsafe_minus"] is None
    assert row["jerk_longitudinal"] == 2.0
    alone = drives([20.0, 22.0], minimum_gap=np.inf)
    assert league_table({("here", "first"): alone}).row(0, named=True)["minimum_gap"] is None
