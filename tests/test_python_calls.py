"""Calls from Python with what is not meant there: they say what was expected and what was got."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import coverdrive as cd
from coverdrive.certificates.methods import _METHODS, Method
from coverdrive.errors import SettingError
from coverdrive.league.agents import AgentPlanner, Idm, Witness
from coverdrive.plan import Plan, Status
from coverdrive.results import Results
from coverdrive.simulation.drives.episode import EpisodeSettings
from shape_checks import unchecked

SHORT = EpisodeSettings(duration=0.3)
TWO = cd.Scene(np.array([0.0, 30.0]), *np.array([[1.8], [20.0], [0.0], [4.5], [1.8]]) * np.ones(2), np.ones(2, bool))


@pytest.fixture(scope="module")
def results(quick_fit: Path) -> Results:
    return Results(quick_fit)


class Straight:
    """A planner of one's own, which keeps its velocity."""

    dt, steps = 0.25, 12

    def reset(self, period: float) -> None: ...

    def plan(self, state: np.ndarray, paths: cd.PredictedPaths, road: cd.Road) -> Plan:
        states = state + np.outer(self.dt * np.arange(self.steps + 1), [state[2], 0.0, 0.0, 0.0])
        inputs = np.zeros((self.steps, 2))
        return Plan(states, inputs, np.zeros(self.steps), Status.SOLVED, 0.0, 0.0, self.dt)


def test_a_predictor_is_loaded_by_a_path_and_by_its_name(quick_predictor: Path) -> None:
    by_name, by_path = cd.Predictor.load(str(quick_predictor)), cd.Predictor.load(quick_predictor)
    assert by_name.fingerprint == by_path.fingerprint


def test_an_agent_drives_as_the_message_says(results: Results) -> None:
    for agent in (Idm(), Idm):
        with unchecked(), pytest.raises(SettingError, match=r"planner: .*AgentPlanner\(agent, witness\).*Witness\(\)"):
            cd.simulate(results.predictor, agent, traffic="drivers", episode=SHORT)
    witness = Witness()
    trace = cd.simulate(witness, AgentPlanner(Idm(), witness), traffic="drivers", vehicles=2, episode=SHORT)
    assert len(trace) == 3


def test_bounds_to_compare_are_one_number_or_several(results: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(_METHODS, Method.SVM, _METHODS[Method.POST_BLOATING])  # takes longer than all others
    once, twice = cd.certify(results, 0.4), cd.certify(results, [0.4])
    assert [each.target for each in once] == [each.target for each in twice]
    with unchecked(), pytest.raises(SettingError, match="targets: expected a number, got 'a'"):
        cd.certify(results, "a")  # pyright: ignore[reportArgumentType]


def test_a_study_of_an_own_planner_has_a_page(results: Results, tmp_path: Path) -> None:
    study = cd.study(
        results.predictor, Straight(), folder=tmp_path / "study", trials=1, traffic="drivers", vehicles=2, episode=SHORT
    )
    assert repr(study) == f"Study(folder={tmp_path / 'study'!r})"
    with pytest.raises(SettingError, match="trial: expected a whole number of at least 0, got -1"):
        study.trace(-1)
    assert repr(study.trace(0)).startswith("<Trace of 3 steps: Outcome(kind=<Kind.FINISHED")
    page = cd.report(results.fitted, study, tmp_path / "page.html")
    assert "Straight" in study.files.description()["planner"]["name"] and page.stat().st_size > 10_000
    with unchecked(), pytest.raises(SettingError, match=r"fitted: expected .*; a study is the second argument, got an"):
        cd.report(study)
    with unchecked(), pytest.raises(SettingError, match="study: expected what `study` gives, got"):
        cd.report(results.fitted, tmp_path)


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (lambda given: cd.simulate("predictor.safetensors"), "predictor: expected a predictor"),
        (lambda given: cd.simulate(given, 5), "planner: expected a planner"),
        (lambda given: cd.simulate(given, traffic=5), "traffic: expected a name, settings, a traffic model"),
        (lambda given: cd.simulate(given, vehicles=-1), "vehicles: expected a whole number of at least 0, got -1"),
        (lambda given: cd.simulate(given, vehicles=10**6), "vehicles: expected a whole number from 0 to 100"),
        (lambda given: cd.simulate(given, trial=0.5), "trial: expected a whole number of at least 0, got 0.5"),
        (lambda given: cd.simulate(given, seed="now"), "seed: expected a whole number"),
        (lambda given: cd.simulate(given, episode=20.0), "episode: expected EpisodeSettings, got 20.0"),
        (lambda given: cd.simulate(given, recordings=["us101.csv"]), "recordings: expected what `coverdrive.read`"),
        (lambda given: cd.simulate(given, road="mountain"), "there is no road 'mountain'"),
        (lambda given: cd.study(given, folder="x", trials=0), "at least one trial"),
        (lambda given: cd.study(given, folder="x", trials=None), "trials: expected a whole number"),
        (lambda given: cd.study(given, folder="x", vehicles=()), "vehicles: expected at least one whole number"),
        (lambda given: cd.study(given, folder="x", until_width="0.1"), "until_width: expected a number"),
        (lambda given: cd.study(given, folder=5), "folder: expected a path, got 5"),
        (lambda given: cd.dial("predictor.safetensors", folder="x"), "predictor: expected a predictor with sets"),
        (lambda given: cd.fit(["us101.csv"]), "recordings: expected what `coverdrive.read` gives, got 'us101.csv'"),
        (lambda given: cd.fit(None), "recordings: expected what `coverdrive.read` gives, got None"),
        (lambda given: cd.fit_folds(5), "recordings: expected what `coverdrive.read` gives, got 5"),
        (lambda given: cd.generate({"scenes": 3}), "settings: expected GeneratedSettings"),
        (lambda given: cd.read(5), "paths: expected a path, got 5"),
        (lambda given: cd.read(None), "paths: expected a path, got None"),
        (lambda given: cd.Predictor.load(5), "path: expected a path, got 5"),
        (lambda given: cd.Driver("predictor.safetensors"), "predictor: expected a predictor"),
        (lambda given: cd.Driver(given, 5), "planner: expected a planner"),
        (lambda given: cd.Driver(given, Straight), r"planner: expected a planner .*, got the class Straight"),
        (lambda given: cd.simulate(type(given)), "predictor: expected a predictor .*, got the class"),
        (lambda given: cd.Driver(given, wanted_speed="fast"), "wanted_speed: expected a number, got 'fast'"),
        (lambda given: cd.Driver(given, period="often"), "period: expected a number, got 'often'"),
        (lambda given: cd.certify(given), "fitted: expected what `fit` gives"),
        (lambda given: cd.compare(5, 6), "first: expected a study, or a path, got 5"),
    ],
)
def test_what_is_not_meant_is_named(
    results: Results, call: Callable[[Any], Any], complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    predictor = results.predictor
    with unchecked(), pytest.raises(SettingError, match=complaint):
        call(predictor)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"ego": True}, "ego = True is not the slot"),
        ({"ego": 1.0}, r"ego = 1\.0 is not the slot"),
        ({"dt": "0.25"}, "must be positive, got '0.25'"),
        ({"steps": "3"}, "whole number of steps, at least one, got '3'"),
        ({"like": 3}, "like: expected a planner, .* got 3"),
        ({"road": None}, "road: expected a Road, got None"),
        ({"scene": None}, "scene: expected a Scene, got None"),
    ],
)
def test_a_prediction_of_what_is_none(results: Results, wrong: dict[str, Any], said: str) -> None:
    asked = {"scene": TWO, "road": cd.Road.straight()} | wrong
    with unchecked(), pytest.raises(SettingError, match=said):
        results.predictor.predict(**asked)


def test_a_prediction_is_of_one_moment(results: Results) -> None:
    with unchecked():
        uneven, several = (
            replace(TWO, speed=TWO.speed[:1]), replace(TWO, **{k: v[None] for k, v in vars(TWO).items()})
        )  # fmt: skip
        for wrong in (uneven, several):
            with pytest.raises(SettingError, match="scene: expected one moment"):
                results.predictor.predict(wrong, cd.Road.straight())


def test_settings_of_a_planner(results: Results) -> None:
    with unchecked(), pytest.raises(SettingError, match=r"settings: expected PlannerSettings, got \{'grace': 0.1\}"):
        cd.Planner({"grace": 0.1})  # pyright: ignore[reportArgumentType]


def test_a_predictor_is_saved_at_a_path(results: Results) -> None:
    with unchecked(), pytest.raises(SettingError, match="path: expected a path, got 3"):
        results.predictor.save(3)  # pyright: ignore[reportArgumentType]
