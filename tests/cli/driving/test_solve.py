"""What ``coverdrive solve`` drives with."""

from pathlib import Path

import pytest
from driving_fakes import PREDICTOR
from problem_fakes import between, goal, written

from command import coverdrive
from coverdrive.config import Experiment
from coverdrive.driving import batch
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


def test_scenarios_are_not_solved_by_what_learned_from_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(left_out, "fit_without", lambda *_: pytest.fail("nothing is to be fitted"))
    scenario = written(tmp_path, goal(between("velocity", 0.0, 60.0)))
    called = "solve", scenario, "--recording", scenario, "--out", tmp_path / "out"
    assert "would train or calibrate what drives it; fit without them by --leave-one-out" in coverdrive(
        *called, status=2
    )
