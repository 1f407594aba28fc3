"""``coverdrive league`` as a user calls it, with the agent of its page."""

import json
import re
from pathlib import Path

import polars as pl
import pytest
from problem_fakes import box, goal, written

from command import coverdrive
from coverdrive.errors import SettingError
from coverdrive.league import problems
from coverdrive.league.entrants import claim_of
from coverdrive.locks import alone
from coverdrive.results import Results
from coverdrive.simulation.roads.initial import VEHICLES
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.replay import REPLAYS

PAGE = Path(__file__).parents[3] / "docs" / "tutorials" / "planner.md"


@pytest.mark.slow
def test_planners_are_driven_in_worlds(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    *_, example = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert example.count("\n") <= 20
    (tmp_path / "mine.py").write_text(example, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    planners = "default", "mine:TwoSeconds", "constant-velocity-box", "known-future", "idm-mobil", "paper-sets"
    wanted = "--trials", "1", "--duration", "1.5", "--workers", "1", "--paper", quick_fit, "--out", "league"
    called = "league", quick_fit, "--planners", *planners, "--worlds", "drivers", "replay", *wanted
    printed = coverdrive(*called, only="stdout")
    assert "• known-future does not drive: only replay tells it what will be" in printed
    assert {path.name for path in Path("league").iterdir()} == {
        "drivers", "replay", "league.csv", "drives.csv", "league.html", "league.png", "league.pdf"
    }  # fmt: skip
    table = pl.read_csv("league/league.csv")
    assert table["planner"].to_list() == [*planners] * 2
    assert table["drives"].to_list() == [1, 1, 1, 0, 1, 1] + [1] * 6
    claim = claim_of(Results(quick_fit).predictor)
    assert claim.startswith("window ≤ ") and claim.endswith(" (90 %), λ 1") and claim in printed
    told = table["sets"].to_list()
    assert told == [claim, None, told[2], None, None, claim, claim, None, told[2], None, None, claim]
    assert told[2].startswith("window ≤ ") and told[2].endswith(" (90 %), λ 1")
    kept = {file: file.stat().st_mtime_ns for file in Path("league").rglob("trials/*.parquet")}
    assert len(kept) == 11
    again = json.loads(coverdrive("--json", *called, only="stdout"))["table"]
    assert [row["mean_speed"] for row in again] == table["mean_speed"].to_list()
    assert {file: file.stat().st_mtime_ns for file in Path("league").rglob("trials/*.parquet")} == kept
    compared = coverdrive("compare", "league/drivers/default", "league/drivers/mine_TwoSeconds")
    assert "mean speed" in compared


@pytest.mark.slow
def test_planning_problems_are_a_world(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problems, "find_spec", lambda _: True)
    written(tmp_path, goal(box(92.0, -1.75, length=20.0)))
    called = "league", quick_fit, "--worlds", f"commonroad:{tmp_path}", "--workers", "1", "--out", tmp_path / "league"
    planners = "default", "constant-velocity-box", "keep-velocity"
    printed = coverdrive(*called, "--planners", *planners, only="stdout")
    assert "1 (2.5–100 %)" in printed
    table = pl.read_csv(tmp_path / "league" / "league.csv")
    assert table["planner"].to_list() == [*planners] and table["drives"].to_list() == [1, 1, 1]
    assert table["solved"].to_list() == [1, 1, 1]
    assert "off road" in (tmp_path / "league" / "league.html").read_text(encoding="utf-8")
    monkeypatch.setattr(problems, "find_spec", lambda _: None)
    assert "install it with `pip install '.[commonroad]'`" in coverdrive(*called, status=2)


@pytest.mark.slow
def test_names_of_nobody_are_refused(quick_fit: Path, tmp_path: Path) -> None:
    called = "league", quick_fit, "--planners", "best", "--out", tmp_path / "league"
    assert "no planner is called 'best'; choose default" in coverdrive(*called, status=2)
    called = "league", quick_fit, "--planners", "default", "--worlds", "moon", "--out", tmp_path / "league"
    assert "no world is called 'moon'; choose set-sampling, drivers" in coverdrive(*called, status=2)


def test_nobody_replays_on_another_road(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[list[str]]()

    def drive(*_: object, worlds: list[str], **__: object) -> None:
        asked.append(worlds)
        raise SettingError("nobody drives")

    monkeypatch.setattr("coverdrive.league.league.league", drive)
    called = "league", quick_fit, "--planners", "keep-velocity", "--out", tmp_path / "league", "--road"
    for name in REPLAYS:
        assert "got the road 'curved'" in coverdrive(*called, "curved", "--worlds", "drivers", name, status=2)
    assert not asked
    for road in ("curved", "paper"):
        assert "nobody drives" in coverdrive(*called, road, status=2)
    elsewhere, usual = asked
    assert [name for name in usual if name not in REPLAYS] == elsewhere and set(REPLAYS) < set(usual)


def test_numbers_of_vehicles_that_are_said_hold_even_if_they_are_the_usual_ones(
    quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[dict[str, object]]()

    def drive(setups: dict[str, Setup], *_: object, **__: object) -> None:
        asked.append({name: each.vehicles for name, each in setups.items()})
        raise SettingError("nobody drives")

    monkeypatch.setattr("coverdrive.league.league.league", drive)
    called = "league", quick_fit, "--out", tmp_path / "league", "--planners", "default", "--worlds"
    for said in ([], ["--vehicles", *map(str, VEHICLES)]):
        assert "nobody drives" in coverdrive(*called, "aggressive", "drivers", *said, status=2)
    with alone(tmp_path / "league"):
        assert "another process writes to" in coverdrive(*called, "drivers", status=2)
    assert asked == [{"aggressive": each, "drivers": VEHICLES} for each in ((8, 10, 12), VEHICLES)]
