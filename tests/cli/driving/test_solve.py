"""What ``coverdrive solve`` drives with."""

from pathlib import Path

import polars as pl
import pytest
from driving_fakes import PREDICTOR
from problem_fakes import between, goal, written

from command import coverdrive
from coverdrive.config import Experiment
from coverdrive.driving import batch, solved
from coverdrive.planning.planner import PlannerSettings
from coverdrive.prediction.fits import left_out
from coverdrive.results import Results


def test_settings_of_the_planner_are_those_of_the_fit_and_what_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said, planners = ("--set", "planner.manners.like=regulation"), list[PlannerSettings]()

    def noted(*arguments: object) -> list[object]:
        planners.extend(each for each in arguments if isinstance(each, PlannerSettings))
        return []

    monkeypatch.setattr(batch, "solve_all", noted)
    monkeypatch.setattr(left_out, "fit_without", lambda *_: PREDICTOR)
    monkeypatch.setattr(Experiment, "recordings", lambda *_: ())
    usual, stored = Experiment(), Experiment().updated({"planner": {"lane_change": 7.0}})
    monkeypatch.setattr(Results, "experiment", stored)
    monkeypatch.setattr(Results, "predictor", PREDICTOR)
    monkeypatch.setattr(Results, "refuse_seen", lambda *_: None)
    called = "solve", written(tmp_path, goal(between("velocity", 0.0, 60.0))), "--out", tmp_path / "out"
    for others in ((), said, ("--predictor", tmp_path), ("--predictor", tmp_path, *said)):
        coverdrive(*called, *others)
    polite = {"planner": {"manners": {"like": "regulation"}}}
    wanted = usual, usual.updated(polite), stored, stored.updated(polite)
    assert planners == [each.planner for each in wanted]
    for name in ("generated.lanes", "prediction.scale"):
        complaint = coverdrive(*called, "--predictor", tmp_path, "--set", f"{name}=2", status=2)
        assert f"{name} made the predictor in {tmp_path}" in complaint.replace("\n", "")


def test_each_scenario_is_solved_once_whatever_it_is_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[list[str]]()
    monkeypatch.setattr(batch, "solve_all", lambda files, *_: asked.append([each.name for each in files]) or [])
    monkeypatch.setattr(Results, "experiment", Experiment())
    monkeypatch.setattr(Results, "predictor", PREDICTOR)
    monkeypatch.setattr(Results, "refuse_seen", lambda *_: None)
    folder = tmp_path / "all"
    folder.mkdir()
    file = written(folder, goal(between("velocity", 0.0, 60.0)), name="a")
    file.rename(folder / "B.XML")
    file = written(folder, goal(between("velocity", 0.0, 60.0)), name="a")
    (tmp_path / "link.xml").symlink_to(file)
    named = file, folder, tmp_path / "all" / ".." / "all" / "a.xml", tmp_path / "link.xml"
    coverdrive("solve", *named, "--predictor", tmp_path, "--out", tmp_path / "out")
    assert asked == [["a.xml", "B.XML"]]


def test_what_is_no_scenario_in_a_folder_ends_nothing_unless_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(left_out, "fit_without", lambda *_: PREDICTOR)
    monkeypatch.setattr(Experiment, "recordings", lambda *_: ())
    monkeypatch.setattr(solved, "refusal", lambda _: None)
    folder = tmp_path / "all"
    (folder / "folder.xml").mkdir(parents=True)
    for name, to in (("lost.xml", "nowhere.xml"), ("loop.xml", "loop.xml")):
        (folder / name).symlink_to(folder / to)
    written(folder, goal(between("velocity", 0.0, 60.0), first=3, last=4), name="there")
    fitted = "--recording", folder / "there.xml", "--leave-one-out"
    coverdrive("solve", folder, *fitted, "--out", tmp_path / "out", status=3)
    table = pl.read_csv(tmp_path / "out" / "solved.csv")
    assert dict(table.select("scenario", "solved").iter_rows()) == {"loop": False, "lost": False, "there": True}
    assert table["reason"].str.starts_with("not read:").sum() == 2
    for name in ("lost.xml", "loop.xml"):
        assert "there is no such scenario" in coverdrive("solve", folder / name, status=2)


def test_a_folder_of_protobuf_is_said_to_be(tmp_path: Path) -> None:
    (tmp_path / "a.pb").write_bytes(b"\n\x0e\n\x052020a")
    complaint = coverdrive("solve", tmp_path, status=2).replace("\n", " ")
    assert "nothing to solve" in complaint and "write them as XML with commonroad-io" in complaint


def test_scenarios_are_not_solved_by_what_learned_from_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(left_out, "fit_without", lambda *_: pytest.fail("nothing is to be fitted"))
    scenario = written(tmp_path, goal(between("velocity", 0.0, 60.0)))
    called = "solve", scenario, "--recording", scenario, "--out", tmp_path / "out"
    assert "would train or calibrate what drives it; fit without them by --leave-one-out" in coverdrive(
        *called, status=2
    )
