"""Summary tables: what they say, and that they fit a terminal of 80 columns."""

import polars as pl
from rich.console import Console
from rich.table import Table

from coverdrive.recordings.summary import Summary
from coverdrive.report.terminal import collisions_table, drives_table, recordings_table
from coverdrive.simulation.trial import SCHEMA


def printed(table: Table) -> str:
    console = Console(width=80)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def summary(groups: tuple[int, ...], repairs: dict[str, int]) -> Summary:
    return Summary("us101_300_vehicles period 1", groups, 235, 15.6, 125_758, 5, 11.8, 29.5, 0.1, repairs)


def trials(**columns: list[object]) -> pl.DataFrame:
    count = len(next(iter(columns.values())))
    zeros = {name: ["finished"] * count if kind == pl.String else [0] * count for name, kind in SCHEMA.items()}
    return pl.DataFrame(zeros | {"time": [20.0] * count} | columns, schema=SCHEMA)


def test_recordings() -> None:
    text = printed(recordings_table([summary((2, 3, 4), {"duplicated rows": 7}), summary((1, 5), {})]))
    for part in ("us101_300_vehicles period 1", "2–4", "1, 5", "125758", "11.8/29.5", "7 duplicated rows", "0.1 s"):
        assert part in text
    assert "…" not in text


def test_collisions_by_number_of_vehicles() -> None:
    kinds = ["finished", "side", "rear-end", "finished"]
    rows = [line.split() for line in printed(collisions_table(trials(vehicles=[3, 3, 4, 4], kind=kinds))).splitlines()]
    counts = {row[1]: (row[3], row[5], row[8]) for row in rows if len(row) > 9 and row[0] == "│"}
    assert counts == {"3": ("2", "1", "0"), "4": ("2", "0", "1"), "all": ("4", "1", "1")}


def test_drives_weigh_statuses_by_time_and_count_departures() -> None:
    text = printed(
        drives_table(
            trials(
                time=[20.0, 5.0],
                share_solved=[1.0, 0.0],
                share_fallback=[0.0, 1.0],
                road_departure=[0.05, 0.4],
                planning_median=[0.010, 0.020],
                mean_speed=[20.0, 22.0],
            )
        )
    )
    for part in (
        "80.00% / 20.00% / 0.00% / 0.00%",
        "1 by more than 0.1 m, at most 0.40 m",
        "median 15.0 ms",
        "21.0 m/s",
    ):
        assert part in text
