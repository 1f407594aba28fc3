"""Tables of studies: what they say."""

import re
from dataclasses import replace

import polars as pl
import pytest
from report_fakes import make_contents, printed

from coverdrive.certificates.certificate import Certificate
from coverdrive.dialling.frontier import frontier
from coverdrive.reporting.figures.frontier import frontier_table
from coverdrive.reporting.page.summary import tiles
from coverdrive.reporting.tables.study import (
    collisions_table,
    comparison_table,
    drives_table,
    safety_table,
    sweep_table,
)
from coverdrive.simulation.measures.trial import SCHEMA
from coverdrive.simulation.studies.comparison import MEASURES, Comparison, Difference


def trials(**columns: list[object]) -> pl.DataFrame:
    count = len(next(iter(columns.values())))
    usual = {"kind": "finished", "at_fault": "none", "cause": "none", "reason": ""}
    empty = {name: [usual.get(name, 0)] * count for name in SCHEMA}
    return pl.DataFrame(empty | {"time": [20.0] * count} | columns, schema=SCHEMA)


def certificate(unit: str, epsilon: float) -> Certificate:
    return Certificate("post-bloating", epsilon, 0.99, 100, unit, 7, 0, 0, 0, 0.75, "")


def facts_of(table) -> dict[str, str]:
    """What a table of facts says, by the name of each fact."""
    names, facts = (list(column.cells) for column in table.columns)
    return dict(zip(names, facts, strict=True))


def test_collisions_by_number_of_vehicles() -> None:
    kinds = [*["finished"] * 19, "side", "rear-end", *["finished"] * 19]
    rows = [
        line.split()
        for line in printed(collisions_table(trials(vehicles=[3] * 20 + [4] * 20, kind=kinds))).splitlines()
    ]
    counts = {row[1]: (row[3], row[5], row[9]) for row in rows if len(row) > 9 and row[0] == "│"}
    assert {name: counts[name] for name in ("3", "4", "all")} == {
        "3": ("20", "1", "0"),
        "4": ("20", "0", "1"),
        "all": ("40", "1", "1"),
    }


def test_the_papers_result_is_beside_ours() -> None:
    line = next(line for line in printed(collisions_table(trials(vehicles=[3]))).splitlines() if "paper" in line)
    for part in ("1000", "7 (0.28–1.5 %)", "20 (1.2–3.1 %)"):
        assert part in line


@pytest.mark.parametrize("vehicles", [[*range(20, 30)] * 2, [25] * 100, [25] * 100 + [24] * 19])
def test_few_trials_with_a_number_of_vehicles_are_not_told_apart(vehicles: list[int]) -> None:
    text = printed(collisions_table(trials(vehicles=vehicles)))
    assert f" {len(vehicles)} " in text and "25 " not in text


def test_misses_stand_beside_the_certificate_and_apart_from_failures() -> None:
    table = trials(
        kind=["side", "frontal", "rear-end", "finished"],
        at_fault=["ego", "ego", "other", "none"],
        cause=["planning failure", "prediction miss", "prediction miss", "none"],
        windows=[100] * 4,
        prediction_misses=[0, 3, 1, 0],
        vehicles_seen=[5] * 4,
        vehicles_missed=[0, 2, 1, 0],
        shares_missed=[0.0, 0.5, 0.1, 0.0],
        near_seen=[2] * 4,
        near_shares_missed=[0.0, 0.4, 0.0, 0.0],
        impossible_choices=[0, 7, 0, 0],
    )
    text = printed(
        safety_table(table, [certificate("window", 0.02), certificate("share", 0.1), certificate("vehicle", 0.144)]),
        240,
    )
    for part in (
        "25 % (1 of 4; 95 % 0.63–81 %)", "50 % (2 of 4; 95 % 6.7–94 %)", "2 / 1 / 0", "1 % (4 of 400;",
        "at most 2 % of windows, with 99 % confidence", "15 % (3 of 20;",
        "3 % (mean of 20;", "5 % (mean of 8;", "at most 10 % of the average vehicle's windows",
        "at most 14.4 % of vehicles, with 99 % confidence", " 7 ",
    ):  # fmt: skip
        assert part in text


def test_replays_have_counts_and_no_intervals() -> None:
    table = trials(
        vehicles=[3, 4], kind=["side", "finished"], cause=["planning failure", "none"], windows=[100] * 2,
        prediction_misses=[0, 3], vehicles_seen=[5] * 2, vehicles_missed=[0, 2],
    )  # fmt: skip
    texts = [
        printed(collisions_table(table, replayed=True), 160),
        printed(safety_table(table, replayed=True), 160),
        printed(sweep_table({"a": table, "b": table}, replayed=["b"]), 160),
    ]
    for text in texts:
        assert "replays of recorded scenes depend on each other: no interval" in " ".join(text.split())
    assert not re.search(r"–\d", texts[0] + texts[1])
    for part in ("50 % (1 of 2)", "1.5 % (3 of 200)", "20 % (2 of 10)"):
        assert part in texts[1]
    lines = {line.split()[0]: line.split() for line in texts[2].splitlines() if line.strip()}
    assert lines["a"][3] == "(1.2–99" and lines["b"][1:6] == ["2", "1", "0", "1.5", "%"]


def test_drives_weigh_statuses_by_time_and_count_departures() -> None:
    table = trials(
        time=[20.0, 5.0],
        share_solved=[1.0, 0.0],
        share_fallback=[0.0, 1.0],
        road_departure=[0.05, 0.4],
        planning_median=[0.010, 0.020],
        mean_speed=[20.0, 22.0],
        minimum_gap=[3.0, 1.5],
        minimum_time_to_collision=[float("inf"), float("inf")],
    )
    text = printed(drives_table(table), 160)
    for part in (
        "80 % / 20 % / 0 % / 0 %", "1 by more than 0.1 m, at most 0.40 m", "median 15.0 ms", "21.0 m/s",
        "least 1.50 m, 1 of 10 trials at most 1.50 m",
    ):  # fmt: skip
        assert part in text


def test_where_nobody_is_near_the_least_is_none() -> None:
    infinite = [float("inf")] * 20
    table = trials(minimum_gap=infinite, minimum_time_to_collision=[1.25, *infinite[1:]], time=[20.0] * 20)
    facts = facts_of(drives_table(table))
    assert facts["gap to another vehicle"] == "none" and not any("inf" in fact for fact in facts.values())
    assert facts["time to collision"] == "least 1.25 s"  # nothing of 1 of 10 trials, which met nobody


@pytest.mark.parametrize(("alone", "said"), [(2, "1.50, 3.00 s in the median trial"), (3, "none")])
def test_headways_are_those_of_drives_behind_somebody_in_terminal_page_and_frontier(alone: int, said: str) -> None:
    infinite = [float("inf")] * alone
    table = trials(
        trial=list(range(2 * (alone == 2) + alone)),
        usual_headway=[*infinite, *[1.0, 2.0] * (alone == 2)],
        median_headway=[*infinite, *[3.0, 3.0] * (alone == 2)],
    )
    usual = said.split(",")[0]
    assert facts_of(drives_table(table))["time headway in 9 of 10 moments behind somebody, in half of them"] == said
    line = frontier({("pilot", "somebody", None): table}, make_contents().predictor)
    shown = "none" if usual == "none" else f"{usual} s"
    assert f" {shown}" in printed(frontier_table(line), 160)
    tile = tiles(replace(make_contents(), trials=table))[1]
    assert tile.value == shown.replace("none", "–")


def test_how_hard_those_behind_braked_is_said_where_it_was_measured() -> None:
    text = printed(drives_table(trials(hardest_braking_behind=[1.0, 3.0, 2.0])), 160)
    assert "2.0 m/s² in the median trial, 1 of 20 trials at least 2.9 m/s²" in text
    assert "of the one behind (in" not in printed(drives_table(trials(hardest_braking_behind=[None])), 160)


def test_a_grid_has_a_line_for_each_cell() -> None:
    cells = {
        "planner.obstacles.order=2,episode.step=0.1": trials(vehicles=[3, 4], kind=["side", "finished"]),
        "planner.obstacles.order=4,episode.step=0.1": trials(vehicles=[3, 4]),
    }
    lines = printed(sweep_table(cells), 120).splitlines()
    assert any(" order=2,step=0.1 " in f" {line} " and "1 (1.2–99 %)" in line for line in lines)
    assert any(" order=4,step=0.1 " in f" {line} " and "0 (0–85 %)" in line for line in lines)


def test_comparisons_show_both_studies_and_the_difference() -> None:
    side = Difference("frontal_or_side", 10, 0.6, 0.2, -0.7, 0.0, 0.2188, (5, 1))
    speed = Difference("mean_speed", 10, 20.0, 21.0, 0.5, 1.5, 1e-9)
    text = printed(comparison_table(Comparison(10, {}, (side,), (speed,))), 100)
    for part in ("10 pairs", "60 %", "-40 % (-70 % … +0 %)", "0.22", "5:1", "+1 (+0.5 … +1.5)", "<0.001"):
        assert part in text


def test_comparisons_show_what_is_unknown_as_a_dash() -> None:
    nan = float("nan")
    alike = Difference("mean_speed", 2, 20.0, 21.0, nan, nan, nan)
    never = Difference("minimum_left", 0, nan, nan, nan, nan, nan)
    text = printed(comparison_table(Comparison(2, {}, (), (alike, never))), 100)
    cells = {line.strip("│ ").split("  ")[0].strip(): line.split() for line in text.splitlines() if "–" in line}
    assert "nan" not in text
    assert cells["mean speed"][-5:] == ["21", "+1", "(–)", "–", "2"]
    assert cells["minimum left"][-5:] == ["–", "–", "–", "–", "0"]


def test_comparisons_of_replays_say_why_there_is_no_interval() -> None:
    nan = float("nan")
    side = Difference("frontal_or_side", 10, 0.6, 0.2, nan, nan, nan, (5, 1))
    text = printed(comparison_table(Comparison(10, {}, (side,), (), replayed=True)), 100)
    assert "-40 % (–)" in text and "5:1" in text and "nan" not in text
    assert "replays of recorded scenes depend on each other: no interval, and no test" in " ".join(text.split())


def test_comparisons_fit_a_narrow_terminal() -> None:
    side = Difference("frontal_or_side", 1000, 0.6, 0.2, -0.7, 0.0, 0.2188, (115, 111))
    measures = [
        Difference(name, 1000, scale * 0.17853, scale * 0.21478, -scale * 0.23214, scale * 0.14631, 4.3211e-5)
        for name in MEASURES
        for scale in (0.01, 1.0, 1000.0)
    ]
    text = printed(comparison_table(Comparison(1000, {}, (side,), tuple(measures))))
    rows = text.split("115:111")[1].split("collisions:")[0]
    for name in MEASURES:
        assert all(word in text for word in name.split("_"))
    small, large = "+0.000362 (-0.00232 … +0.00146)", "+36.2 (-232 … +146)"
    for part in ("0.00179", "0.00215", small, "178.5", large, "<0.001", " 1000"):
        assert rows.count(part) >= len(MEASURES)


@pytest.mark.parametrize("width", [40, 60])
def test_nothing_is_cut_in_a_narrow_terminal(width: int) -> None:
    driven = trials(vehicles=[3, 4], windows=[1000, 2000], prediction_misses=[12, 7], mean_speed=[21.5, 33.25])
    difference = Difference("frontal_or_side", 10, 0.6, 0.2, -0.7, 0.0, 0.2188, (5, 1))
    tables = (
        collisions_table(driven),
        safety_table(driven, [certificate("window", 0.1234)]),
        drives_table(driven),
        sweep_table({"planner.problem.obstacles.order=2": driven, "[red]": driven}),
        comparison_table(Comparison(10, {}, (difference,), ())),
    )
    for table in tables:
        words = [set(re.findall(r"[\d.+–…%-]*\d[\d.%]*", printed(table, each))) for each in (200, width)]
        assert words[0] and words[0] <= words[1]
        assert max(map(len, printed(table, width).splitlines())) <= width
