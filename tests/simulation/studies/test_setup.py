"""What tells studies apart: who takes part, and what is replayed."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor

from coverdrive.league.agents import AgentPlanner, Witness
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.prediction.adaptive import Adaptive
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.studies.setup import Setup, described
from coverdrive.simulation.traffic.replay import Scenario


class Mine(ConstantPlanner):
    """Of a user's, who keeps to himself what it is made with; also an agent."""

    def __init__(self, gain: Any):
        self._gain, self.driven = gain, 0

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        return float(self._gain), 0.0


def around(gain: Any) -> Callable[[], Mine]:
    return lambda: Mine(gain)


def given(gain: float) -> Callable[[], Mine]:
    return lambda gain=gain: Mine(gain)


@pytest.mark.parametrize(
    "make",
    [
        lambda value: partial(MpcPlanner, settings=PlannerSettings(lane_change=value)),
        lambda value: partial(Mine, value),
        Mine,
        lambda value: Mine([value]),
        lambda value: Mine({"gain": np.array([value])}),
        lambda value: partial(Mine, [np.float32(value)]),
        around,
        lambda value: around([value]),
        given,
        lambda value: AgentPlanner(Mine(value), Witness()),
        lambda value: Mine([boxes(value)]),
        lambda value: partial(Mine, boxes(value)),
        lambda value: Mine({"set": {value}, "path": Path(f"{value}")}),
    ],
    ids=[
        "settings by name",
        "a value",
        "a private attribute",
        "a list",
        "an array",
        "a list of numpy",
        "a variable around",
        "a list around",
        "what is usual",
        "an agent",
        "a belief in a list",
        "a belief",
        "a set and a path",
    ],
)
def test_what_is_made_with_other_values_is_another_one(make: Callable[[float], Any]) -> None:
    one, same, other = (described(make(value)) for value in (1.0, 1.0, 2.0))
    assert one == same != other


class Wider:
    """A belief of a user's around another one, with no hash."""

    def __init__(self, predictor: Any, share: float = 1.0):
        self.predictor, self.share = predictor, share

    def predict(self, *scene: Any) -> Any:
        return self.predictor.predict(*scene)

    def scaled(self, scale: float) -> "Wider":
        return Wider(self.predictor, scale * self.share)


def boxes(size: float) -> ConstantVelocity:
    return ConstantVelocity(np.full((3, 2), size))


@pytest.mark.parametrize(
    "make",
    [
        lambda value: Wider(boxes(value)),
        lambda value: Wider(boxes(1.0), value),
        lambda value: Wider(Wider(boxes(value))),
    ],
    ids=["another belief", "a value", "another belief within"],
)
@pytest.mark.parametrize("adapts", [False, True])
def test_a_belief_that_is_made_with_another_one_is_another_one(make: Callable[[float], Any], adapts: bool) -> None:
    made = (Adaptive(make(value)) if adapts else make(value) for value in (1.0, 1.0, 2.0))
    one, same, other = (json.dumps(Setup(each).description()["predictor"]) for each in made)
    assert one == same != other


def test_other_agents_are_other_planners_and_what_holds_itself_is_described() -> None:
    class Other(Mine):
        pass

    one, other = (described(AgentPlanner(agent(1.0), Witness())) for agent in (Mine, Other))
    assert one != other
    knot = Mine(1.0)
    knot._gain = [knot]
    assert json.dumps(described(knot))


def test_recordings_are_told_by_a_hash() -> None:
    one, other = (generate(GeneratedSettings(scenes=1, duration=2.0), seed) for seed in (1, 2))
    texts = [json.dumps(described(Mine(each))) for each in (one, one, other)]
    assert texts[0] == texts[1] != texts[2] and len(texts[0]) < 300


def test_who_has_driven_is_the_same() -> None:
    mine = Mine(1.0)
    before, mine.driven = described(mine), 7
    assert described(mine) == before


@pytest.mark.parametrize(
    "changes",
    [
        {"sizes": np.full((2, 2), 3.0)},
        {"valid": np.eye(3, 2, dtype=bool)},
        {"dt": 0.2},
        {"road": Road.straight(lanes=2)},
    ],
)
def test_other_replays_are_of_another_study(changes: dict[str, Any]) -> None:
    scenario = Scenario(np.zeros((3, 2, 4)), np.full((2, 2), 2.0), np.ones((3, 2), bool), 0.1, Road.straight())
    setup = Setup(FakePredictor(FakeBasis.make()), traffic="replay", scenarios=(scenario,))
    other = replace(setup, scenarios=(replace(scenario, **changes),))
    assert setup.description() == replace(setup, scenarios=(replace(scenario),)).description() != other.description()
