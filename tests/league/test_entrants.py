"""Who takes part, by name or as module:factory, and with what."""

import importlib
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor, make_scene

from coverdrive.certificates.certificate import Certificate
from coverdrive.errors import SettingError, blamed
from coverdrive.league.agents import AgentPlanner
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.league.entrants import ENTRANTS, Known, Place, Seat, claim_of, entrant
from coverdrive.plan import Planner, Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.road import Road
from coverdrive.simulation.studies.setup import described, made

KNOWN = Known(FakePredictor(FakeBasis.make()), "no paper", "no box", PlannerSettings())
PLACE = Place(PlannerSettings(lane_change=7.0))


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Modules are found in the current folder."""
    monkeypatch.chdir(Path(__file__).parent)


def seat(name: str, place: Place = PLACE) -> Seat:
    found = entrant(name)(KNOWN, place)
    assert isinstance(found, Seat)
    return found


CLAIM = Certificate("conformal, pooled", 0.1, 0.99, 100, "share", 1, 0, 0, 0, 1.0, "0", scale=0.6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "share ≤ 10 % (99 %), λ 0.6"),
        ({"confidence": None, "unit": "window", "scale": 1.0}, "window ≤ 10 % (on average), λ 1"),
        ({"groups": 5, "unit": "vehicle"}, "vehicle of each base ≤ 10 % (99 %), λ 0.6"),
        ({"epsilon": 1.0}, "no bound, λ 0.6"),
    ],
)
def test_claims_of_sets_are_told_in_a_few_words(changes: dict[str, Any], said: str) -> None:
    box = ConstantVelocity(claim=replace(CLAIM, **changes))
    assert claim_of(box) == said
    assert claim_of(box.scaled(2.0)) == claim_of(seat("idm").belief) == claim_of(None) == ""


def test_who_does_not_apply_says_why() -> None:
    reasons = {name: make(KNOWN, PLACE) for name, make in ENTRANTS.items()}
    out = {name: reason for name, reason in reasons.items() if isinstance(reason, str)}
    assert out == {
        "paper": "no paper",
        "paper-sets": "no paper",
        "constant-velocity-box": "no box",
        "known-future": "only replay tells it what will be",
        "fiss-future": "it solves planning problems of CommonRoad alone",
        "fiss-constant-velocity": "it solves planning problems of CommonRoad alone",
        "own": "there everybody else is the world's own driver",
    }
    assert seat("own", PLACE._replace(own_driver=True)) == (None, None)


def test_ours_drive_with_the_settings_of_the_place() -> None:
    for name in ("default", "constant-velocity"):
        planner = seat(name).planner
        assert isinstance(planner, MpcPlanner) and planner.settings is PLACE.settings
    assert seat("default").belief is KNOWN.predictor
    assert isinstance(seat("constant-velocity").belief, ConstantVelocity)


def test_a_planner_of_ones_own_plans_against_the_default_sets() -> None:
    found = seat("entered:planner")
    assert found.belief is KNOWN.predictor
    assert callable(found.planner)
    assert isinstance(found.planner(), ConstantPlanner)
    ours = made(seat("entered:theirs").planner, Planner)
    assert isinstance(ours, MpcPlanner) and ours.settings == PLACE.settings.model_copy(update={"lane_change": 0.0})


@pytest.mark.parametrize(("name", "acceleration"), [("gentle", -0.25), ("gentler", -0.125), ("told", 7.0)])
def test_settings_are_given_to_who_needs_or_names_them(name: str, acceleration: float) -> None:
    planner = made(seat(f"entered:{name}").planner, Planner)
    assert isinstance(planner, ConstantPlanner) and planner.inputs[0, 0] == acceleration


def test_a_belief_of_ones_own_has_our_planner() -> None:
    found = seat("entered:belief")
    assert isinstance(found.belief, ConstantVelocity)
    assert np.all(found.belief.beyond == PLACE.settings.problem.vehicle.width / 2)
    assert isinstance(found.planner, MpcPlanner) and found.planner.settings is PLACE.settings


MINE = """
from entered import Agent, ConstantPlanner

GAIN = {gain}


class Steady(Agent):
    def act(self, scene, road):
        return GAIN, 0.0


def planner():
    return ConstantPlanner(GAIN)
"""


def test_an_agent_sees_the_scene_and_its_plan_promises_nothing() -> None:
    found, road = seat("entered:Agent"), Road.straight()
    assert callable(found.planner) and found.belief is not None
    planner = found.planner()
    assert isinstance(planner, AgentPlanner)
    planner.reset(0.1)
    for ahead, expected in ((30.0, -1.0), (-30.0, 0.0)):
        scene = make_scene([0.0, ahead], [1.8, 5.4])
        paths = found.belief.predict(scene, road, 0, planner.dt, planner.steps)
        plan = planner.plan(scene.states[0], paths, road)
        assert plan.inputs.tolist() == [[expected, 0.0]] * planner.steps
        assert plan.states[-1, 2] == pytest.approx(20 + 3 * expected)
        assert plan.status is Status.INVALID_INPUT
    assert planner.agent.periods == [0.1]


@pytest.mark.parametrize("name", ["steady:Steady", "steady:planner"])
def test_who_was_changed_in_its_module_is_another_one(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if what was changed is not in the source of the class or function that is named."""
    monkeypatch.syspath_prepend(tmp_path)

    def told(gain: float) -> Any:
        (tmp_path / "steady.py").write_text(MINE.format(gain=gain))
        monkeypatch.delitem(sys.modules, "steady", raising=False)
        importlib.invalidate_caches()
        return described(seat(name).planner)

    assert told(1.0) == told(1.0) != told(2.0)
    assert told(1.0) != described(seat("entered:planner").planner)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("best", "no planner is called 'best'; choose default, paper"),
        ("nowhere:best", "No module named 'nowhere'"),
        ("entered:best", "has no attribute 'best'"),
        ("entered:number", "entered:number is 3; expected a function"),
        (":best", "expected module:factory"),
    ],
)
def test_mistakes_are_explained(name: str, complaint: str) -> None:
    with pytest.raises(SettingError, match=re.escape(complaint)):
        entrant(name)


def test_what_cannot_drive_is_refused() -> None:
    with pytest.raises(SettingError, match="entered:nobody made 'nobody'; expected a planner"):
        entrant("entered:nobody")(KNOWN, PLACE)


def test_what_a_module_or_a_factory_raises_says_whose_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_module.py").write_text("number = undefined\n")
    (tmp_path / "broken_factory.py").write_text("def make():\n    raise OSError('no weights')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(NameError) as raised:
        entrant("broken_module:make")
    assert blamed(raised.value) == "this came from the module broken_module, which is not of coverdrive"
    with pytest.raises(OSError, match="no weights") as failed:
        seat("broken_factory:make")
    assert blamed(failed.value) == "this came from the entrant broken_factory.make, which is not of coverdrive"
