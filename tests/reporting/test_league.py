"""The league as tables, figure and page."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from report_fakes import make_contents

from coverdrive.league.table import SCHEMA
from coverdrive.reporting.figures.league import league_figure
from coverdrive.reporting.page.page import page
from coverdrive.reporting.plotting.drawing import draw
from coverdrive.reporting.plotting.figure import Line, Points
from coverdrive.reporting.report import write_league
from coverdrive.reporting.tables.league import COLUMNS, ON_PROBLEMS, worlds_of


def line(world: str, planner: str, at_fault: int, speed: float, minus: float | None = None, drives: int = 40) -> dict:
    row = dict.fromkeys(SCHEMA) | {"world": world, "planner": planner, "drives": drives, "at_fault": at_fault}
    row |= {"not_at_fault": 0, "mean_speed": speed, "least_gap": 0.4, "planning_median": 0.0042, "minimum_gap": 2.5}
    for name in ("at_fault", "not_at_fault"):
        row |= {f"{name}_low": max(0.0, at_fault / drives - 0.02), f"{name}_high": at_fault / drives + 0.08}
    row |= {"mean_speed_low": speed - 0.25, "mean_speed_high": speed + 0.5}
    if minus is not None:
        row |= {"mean_speed_minus": minus, "mean_speed_minus_low": minus - 0.5, "mean_speed_minus_high": minus + 0.75}
    return row


CLAIM = "share ≤ 10 % (99 %), λ 0.6"
TABLE = pl.DataFrame(
    [
        line("drivers", "default", 0, 25.0) | {"sets": CLAIM},
        line("drivers", "idm-mobil", 0, 22.0, -3.0),
        line("drivers", "fast", 4, 28.0, 3.0),
        line("drivers", "clumsy", 8, 26.0, 1.0),
        dict.fromkeys(SCHEMA) | {"world": "drivers", "planner": "own<er>", "drives": 0, "left_out": "not here"},
        line("sumo-1500", "default", 1, 30.0),
    ],
    schema=SCHEMA,
)


def test_cells_have_counts_and_differences() -> None:
    drivers, sumo = worlds_of(TABLE)
    assert [dict(zip(COLUMNS, row, strict=True))["sets"] for row in drivers.rows] == [CLAIM, "", "", ""]
    cells = dict(zip(COLUMNS, drivers.rows[2], strict=True))
    assert cells["at fault"] == "4 (8–18 %)"
    assert cells["mean speed [m/s]"] == "28.00 (Δ +2.50 … +3.75)"
    assert (cells["unsafe [%]"], cells["gap [m]"], cells["least"], cells["step [ms]"]) == ("–", "2.5", "0.4", "4.2")
    assert drivers.rows[0][4] == "25.00"
    assert drivers.left_out == ["own<er> does not drive: not here"]
    assert (sumo.name, len(sumo.rows), sumo.left_out) == ("sumo-1500", 1, [])


def test_without_anybody_near_there_is_no_least_gap() -> None:
    (world,) = worlds_of(pl.DataFrame([line("drivers", "alone", 0, 25.0) | {"least_gap": np.inf}], schema=SCHEMA))
    assert dict(zip(COLUMNS, world.rows[0], strict=True))["least"] == "none"


def test_replays_have_no_intervals() -> None:
    row = line("replay", "default", 4, 25.0) | {name: None for name in SCHEMA if name.endswith(("_low", "_high"))}
    table = pl.DataFrame([row], schema=SCHEMA)
    (world,) = worlds_of(table)
    cells = dict(zip(COLUMNS, world.rows[0], strict=True))
    assert (cells["at fault"], cells["not at fault"], cells["mean speed [m/s]"]) == ("4", "0", "25.00")
    figure = league_figure(table)
    assert figure is not None
    (mark,) = (each for each in figure.panels[0].marks if isinstance(each, Points))
    assert (mark.low, mark.high, mark.hover) == (None, None, ["default\n4 of 40 collided at fault\n25.00 m/s"])


def test_long_names_of_worlds_do_not_cover_each_other() -> None:
    worlds = [f"commonroad:scenarios/USA_US101-{k}_1_T-1.xml,scenarios/USA_US101-{k}_2_T-1.xml" for k in range(3)]
    figure = league_figure(pl.DataFrame([line(world, "default", 0, 25.0) for world in worlds], schema=SCHEMA))
    assert figure is not None and all(panel.title.endswith("_2_T-1.xml (40 drives)") for panel in figure.panels)
    drawn = draw(figure)
    FigureCanvasAgg(drawn).draw()
    places = [axes._left_title.get_window_extent() for axes in drawn.axes]
    ends = [*(place.x0 for place in places[1:]), drawn.bbox.x1]
    assert all(place.x1 < end for place, end in zip(places, ends, strict=True))


def posed(planner: str, solved: int, minus: float | None = None) -> dict:
    row = line("commonroad:here", planner, 1, 13.0) | {"solved": solved, "off_road": 0, "progress": 0.9}
    row |= {"solved_low": 0.762, "solved_high": 0.944, "off_road_low": 0.0, "off_road_high": 0.07}
    if minus is not None:
        row |= {"solved_minus": minus, "solved_minus_low": minus - 0.1, "solved_minus_high": minus + 0.15}
    return row


def test_problems_have_columns_and_an_axis_of_their_own() -> None:
    table = pl.DataFrame([line("drivers", "default", 0, 25.0), posed("default", 35), posed("idm", 14, -0.525)],
                         schema=SCHEMA)  # fmt: skip
    drivers, problems = worlds_of(table)
    assert (drivers.columns, problems.columns) == (COLUMNS, ON_PROBLEMS)
    first, second = (dict(zip(ON_PROBLEMS, row, strict=True)) for row in problems.rows)
    assert (first["solved"], second["solved"]) == ("35 (76–95 %)", "14 (76–95 %) (Δ -62 … -38)")
    assert (first["off road"], first["progress [%]"]) == ("0 (0–7 %)", "90")
    figure = league_figure(table)
    assert figure is not None
    left, right = figure.panels
    assert (left.y.label, right.y.label) == ("mean speed [m/s]", "solved [%]")
    (idm,) = (mark for mark in right.marks if isinstance(mark, Points) and mark.name == "idm" and mark.along == "y")
    assert (idm.y, idm.low, idm.high) == ([35.0], [pytest.approx(76.2)], [pytest.approx(94.4)])


def test_the_figure_has_a_mark_for_everybody_and_a_frontier() -> None:
    figure = league_figure(TABLE)
    assert figure is not None
    first, second = figure.panels
    assert (first.title, second.title) == ("drivers (40 drives)", "sumo-1500 (40 drives)")
    (frontier,) = (mark for mark in first.marks if isinstance(mark, Line))
    assert np.array([frontier.x, frontier.y]).T.tolist() == [
        [0.0, 25.0],
        [10.0, 28.0],
    ]  # nobody else is safer or faster
    assert set(figure.named) == {"default", "idm-mobil", "fast", "clumsy"}
    fast = [mark for mark in first.marks if isinstance(mark, Points) and mark.name == "fast"]
    across, along = fast
    assert (across.along, across.low, across.high) == ("x", [pytest.approx(8.0)], [pytest.approx(18.0)])
    assert (along.along, along.low, along.high) == ("y", [pytest.approx(27.75)], [pytest.approx(28.5)])
    assert league_figure(TABLE.filter(pl.col("drives") == 0)) is None


def test_the_page_stands_alone(tmp_path: Path) -> None:
    write_league(TABLE, tmp_path)
    page = (tmp_path / "league.html").read_text(encoding="utf-8")
    assert (tmp_path / "league.png").exists() and (tmp_path / "league.pdf").exists()
    assert "28.00 (Δ +2.50 … +3.75)" in page and "own&lt;er&gt; does not drive: not here" in page
    assert CLAIM in page and page.count("<table>") == 2 and '"type":"Points"' in page
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)", page)
    write_league(TABLE.filter(pl.col("drives") == 0), tmp_path)
    assert "own&lt;er&gt;" in (tmp_path / "league.html").read_text(encoding="utf-8")


def test_the_report_has_a_section_for_it() -> None:
    contents = make_contents()
    assert 'id="league"' not in page(contents)
    text = page(replace(contents, league=TABLE))
    assert '<a href="#league">' in text and 'id="figure-league"' in text and "28.00 (Δ +2.50 … +3.75)" in text
