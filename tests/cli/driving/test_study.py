"""What ``coverdrive study`` prints of drives."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import polars as pl
import pytest
from simulation_fakes import fakes

from command import coverdrive
from coverdrive.certificates.bounds import rate_limit
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.drives import Proof, anytime_limit
from coverdrive.cli.driving.study import study_and_print
from coverdrive.config import Experiment, StudySettings
from coverdrive.dialling.dial import Dialled
from coverdrive.errors import SettingError
from coverdrive.percentages import at_most
from coverdrive.results import Results
from coverdrive.simulation.studies.study import Study


@pytest.mark.parametrize(("traffic", "width"), [("replay", None), ("reactive-replay", None), ("drivers", 0.3)])
def test_the_width_of_a_folder_does_not_end_replays(
    quick_fit: Path, monkeypatch: pytest.MonkeyPatch, traffic: str, width: float | None
) -> None:
    fitted, asked = Experiment.load(quick_fit / "config.toml"), list[float | None]()

    def run(_: Study, trials: int, *, until_width: float | None, **__: object) -> None:
        asked.append(until_width)
        raise SettingError("nobody drives")

    monkeypatch.setattr(Results, "experiment", fitted.updated({"study": {"until_width": 0.3}}))
    monkeypatch.setattr(Study, "run", run)
    for said in ((), ("--until-width", "0.2")):
        assert "nobody drives" in coverdrive("study", quick_fit, "--traffic", traffic, *said, status=2)
    assert asked == [width, 0.2]


@pytest.mark.parametrize(
    "said",
    ["study --trials 1.5", "study --vehicles 3 4.5", "drive --trial 0.4", "report --trial 3 4.5", "fit --seed 1.6"],
)
def test_fractions_of_whole_numbers_are_not_rounded(said: str) -> None:
    assert "a whole number, got" in (complained := coverdrive(*said.split(), status=2)) or "into int" in complained


@pytest.mark.parametrize("part", ["dialled", "certified"])
def test_what_is_damaged_is_told_before_anything_is_driven(
    quick_fit: Path, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    def damaged(_: Results) -> None:
        raise SettingError(f"{part} is damaged")

    monkeypatch.setattr(Results, part, property(damaged))
    monkeypatch.setattr(Study, "run", lambda *_, **__: pytest.fail("it drives"))
    assert f"{part} is damaged" in coverdrive("study", quick_fit, "--trials", "1", status=2)


def test_a_combination_of_settings_that_is_named_twice_is_refused(quick_fit: Path) -> None:
    swept = "study", quick_fit, "--set", "planner.problem.obstacles.order=2,4", "episode.duration=3,3.0"
    complained = coverdrive(*swept, status=2)
    assert "order=2,episode.duration=3 and" in complained and "episode.duration=3.0 are the same" in complained


def test_a_study_that_went_on_proves_what_holds_at_any_time(tmp_path: Path) -> None:
    results: Any = SimpleNamespace(certified=SimpleNamespace(planned_against=()), dialled=None)
    for trials, limit in ((3, rate_limit(0.99, 0, 3)), (4, anytime_limit(0, 4, 0.99)), (4, anytime_limit(0, 4, 0.99))):
        told = study_and_print(Study(fakes(), tmp_path), results, StudySettings(trials=trials, workers=1))
        assert f"at most {at_most(limit)} of" in told["proved"]


def test_in_what_drives_are_others_than_those_that_the_dial_proved_is_told_to_scripts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, proof = Study(fakes(), tmp_path), Proof("collide", 0, 50, 0.1, 0.1, 0.99, "named beforehand", "1-s drives")
    described = json.loads(json.dumps(study.setup.description()))
    for changed, said in (
        ({}, ""),
        ({"vehicles": [9]}, "These drives are others than those that were proved: vehicles"),
    ):
        proved = Dialled(0.5, True, (proof,), 20.0, Mock(Certificate), "There.", described | changed, pl.DataFrame())
        results: Any = SimpleNamespace(certified=SimpleNamespace(planned_against=()), dialled=proved)
        told = study_and_print(study, results, StudySettings(trials=1, workers=1))
        printed = " ".join(capsys.readouterr().out.split())
        assert told["unlike"].startswith(said) and (told["unlike"] == "") == (said == "")
        assert proved.sentence in printed and told["unlike"] in printed


def test_sweeps_in_other_traffics_have_folders_of_their_own(quick_fit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    driven = list[str]()

    def run(study: Study, *_: object, **__: object) -> None:
        driven.append(study.folder.relative_to(quick_fit).as_posix())
        raise SettingError("nobody drives")

    monkeypatch.setattr(Study, "run", run)
    other = "--traffic", "aggressive", "--road", "curved"
    for said in ((), ("--traffic", "set-sampling"), ("--traffic", "drivers"), other):
        assert "nobody drives" in coverdrive("study", quick_fit, *said, "--set", "episode.duration=3", status=2)
    folders = "sweep", "sweep", "sweep-drivers", "sweep-aggressive-curved"
    assert driven == [f"{name}/episode.duration=3" for name in folders]
