"""What code of the user's raises stays what it is, and says whose it is and where in a drive."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from simulation_fakes import FAST, ConstantPlanner, FakeBasis, FakePredictor, fakes

from coverdrive.cli.shared.edge import status_of
from coverdrive.driving.driver import Driver
from coverdrive.errors import SettingError, blamed, blaming, during, name_of
from coverdrive.league.agents import AgentPlanner, Witness
from coverdrive.road import Road
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.driver_traffic import DriverTraffic
from shape_checks import unchecked

MINE = """
import numpy as np
from coverdrive.plan import Plan, Status


class Odd(Exception):
    def __init__(self, one, other):
        super().__init__(f"{one} and {other}")


class Planner:
    dt, steps = 0.25, 12

    def reset(self, period):
        self.calls = 0

    def plan(self, state, paths, road):
        self.calls += 1
        if self.calls == 3:
            self.fail()
        return Plan(np.tile(state, (13, 1)), np.zeros((12, 2)), np.zeros(12), Status.SOLVED, 0.0, 0.0, 0.25)

    def fail(self):
        return 1 / 0


class OddPlanner(Planner):
    def fail(self):
        raise Odd(1, 2)
"""
"""a module of the user's"""


class Third:
    """Fails when it is asked for the third time in a drive."""

    def __init__(self, error: Exception | None = None):
        self.error, self.calls = error or ZeroDivisionError("three"), 0

    def count(self) -> None:
        self.calls += 1
        if self.calls == 3:
            raise self.error


class BadPlanner(ConstantPlanner):
    def reset(self, period):
        self.third = Third()

    def plan(self, state, paths, road):
        self.third.count()
        return super().plan(state, paths, road)


class Nothing(ConstantPlanner):
    def plan(self, state, paths, road):
        return None


class Plans(ConstantPlanner):
    """Its plans are those of a constant planner with something changed."""

    def __init__(self, **changed: Any):
        super().__init__()
        self.changed = changed

    def plan(self, state, paths, road):
        return replace(super().plan(state, paths, road), **self.changed)


class Returns:
    """Its paths are not what they should be."""

    def __init__(self, change: Callable[[Any], Any]):
        self.change = change

    def predict(self, scene, road, ego, dt, steps):
        return self.change(FakePredictor(FakeBasis.make()).predict(scene, road, ego, dt, steps))


class Moves(DriverTraffic):
    """Its steps are not what they should be."""

    def __init__(self, change: Callable[[Any], Any]):
        super().__init__()
        self.change = change

    def step(self, scene, dt):
        return self.change(super().step(scene, dt))


class BadTraffic(DriverTraffic):
    def reset(self, scene, road, rng, controlled=None):
        self.third = Third(OSError("no such port"))
        super().reset(scene, road, rng, controlled)

    def step(self, scene, dt):
        self.third.count()
        return super().step(scene, dt)


class BadAgent:
    def reset(self, period):
        self.third = Third()

    def act(self, scene, road):
        self.third.count()
        return 0.0, 0.0


class BadPredictor(FakePredictor):
    def choices(self, scene, road, times):
        raise KeyError("base")


def no_planner() -> ConstantPlanner:
    raise RuntimeError("no licence")


def agents() -> AgentPlanner:
    return AgentPlanner(BadAgent(), Witness())


def of_an_agent() -> Setup:
    witness = Witness()
    return Setup(witness, AgentPlanner(BadAgent(), witness), "drivers", FAST)


STEP = "in step 3, 0.2 s after the start, "
CASES: list[tuple[Callable[[], Setup], type[Exception], str, str, str]] = [
    (partial(fakes, BadPlanner), ZeroDivisionError, "planner", "BadPlanner", STEP),
    (partial(fakes, Nothing), TypeError, "planner", "Nothing", "in step 1, 0 s after the start, "),
    (partial(fakes, traffic=BadTraffic), OSError, "traffic", "BadTraffic", STEP),
    (of_an_agent, ZeroDivisionError, "agent", "BadAgent", STEP),
    (lambda: Setup(BadPredictor(FakeBasis.make()), ConstantPlanner, episode=FAST), KeyError, "predictor",
     "BadPredictor", "in step 1, 0 s after the start, "),
]  # fmt: skip


@pytest.mark.parametrize(("setup", "kind", "role", "name", "step"), CASES, ids=lambda value: str(value)[:20])
def test_whose_code_failed_and_where_is_said(
    setup: Callable[[], Setup], kind: type[Exception], role: str, name: str, step: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    said = f"this came from the {role} {__name__}.{name}, which is not of coverdrive, {step}in trial 7 of seed 0"

    def drive() -> Trace:
        with unchecked():
            return setup().drive(7)

    with pytest.raises(kind) as raised:
        drive()
    assert blamed(raised.value) == said
    assert status_of(drive, lambda: False) == 2
    complaints = capsys.readouterr().err
    assert complaints.endswith(f"; {said}\n") and "report" not in complaints.splitlines()[-1]
    assert "Traceback" in complaints and kind.__name__ in complaints


WRONG: dict[str, Callable[[], Setup]] = {
    "plan: expected coverdrive.plan.Plan, got None": partial(fakes, Nothing),
    "inputs of the plan: expected an array, got [[0.0, 0.0]]": partial(fakes, Plans(inputs=[[0.0, 0.0]])),
    "status of the plan: expected coverdrive.plan.Status, got 'solved'": partial(fakes, Plans(status="solved")),
    "expected states of the plan of the shape": partial(fakes, Plans(states=np.zeros((2, 4)))),
    "predict: expected coverdrive.paths.PredictedPaths, got None": lambda: believing(lambda paths: None),
    "expected half sizes of the shape": lambda: believing(
        lambda paths: replace(paths, half_sizes=paths.half_sizes[:, 0])
    ),
    "expected vehicles of the shape": lambda: believing(lambda paths: replace(paths, vehicle=paths.vehicle[:1])),
    "step: expected coverdrive.simulation.traffic.model.TrafficStep, got None": partial(
        fakes, traffic=Moves(lambda moved: None)
    ),
    "expected states of the scene of the shape": partial(
        fakes, traffic=Moves(lambda moved: replace(moved, scene=jax.tree.map(lambda each: each[:2], moved.scene)))
    ),
}


def believing(change: Callable[[Any], Any]) -> Setup:
    return Setup(Returns(change), ConstantPlanner, "drivers", FAST)


@pytest.mark.parametrize(("said", "setup"), WRONG.items(), ids=range(len(WRONG)))
def test_what_is_returned_by_parts_of_users_is_what_it_should_be(said: str, setup: Callable[[], Setup]) -> None:
    with unchecked(), pytest.raises((TypeError, ValueError), match=re.escape(said)) as raised:
        setup().drive(7)
    assert blamed(raised.value).endswith("in trial 7 of seed 0") and "which is not of coverdrive" in blamed(
        raised.value
    )


def test_what_makes_a_part_is_named_as_well() -> None:
    with pytest.raises(RuntimeError, match="no licence") as raised:
        fakes(partial(no_planner)).participants()
    assert blamed(raised.value) == f"this came from the planner {__name__}.no_planner, which is not of coverdrive"


def test_a_driver_in_another_world_says_the_step() -> None:
    driver, state = Driver(FakePredictor(FakeBasis.make()), BadPlanner()), (0.0, 1.8, 20.0, 0.0)
    with unchecked(), pytest.raises(ZeroDivisionError) as raised:
        for _ in range(3):
            driver.step(state, {}, Road.straight())
    assert blamed(raised.value).endswith(f"BadPlanner, which is not of coverdrive, {STEP}"[:-2])


def test_faults_of_this_package_and_errors_with_words_of_their_own_stay_as_they_are() -> None:
    ours: list[Any] = [DriverTraffic(), DriverTraffic, "coverdrive.league"]
    for part in ours:
        with pytest.raises(KeyError) as raised, during("somewhere"), blaming("traffic", part):
            raise KeyError(1)
        assert not blamed(raised.value)
    with pytest.raises(SettingError) as said, blaming("planner", "mine"):
        raise SettingError("too many")
    assert not blamed(said.value)


def test_a_part_that_holds_another_is_not_blamed_for_it() -> None:
    with pytest.raises(KeyError) as raised, blaming("planner", "theirs"), during("here"), blaming("agent", "mine.A"):
        raise KeyError(1)
    assert blamed(raised.value) == "this came from the agent mine.A, which is not of coverdrive, here"


def test_names_are_those_of_classes_and_functions() -> None:
    assert name_of(np.zeros(1)) == name_of(np.ndarray) == "numpy.ndarray"
    assert name_of(partial(partial(no_planner))) == f"{__name__}.no_planner"


@pytest.mark.slow
@pytest.mark.parametrize(("planner", "said"), [("Planner", "1 / 0"), ("OddPlanner", "raise Odd(1, 2)")])
def test_of_another_process_the_lines_that_failed_are_shown_too(planner: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "main.py").write_text(
        "import mine\n"
        "from coverdrive.league.agents import Witness\n"
        "from coverdrive.simulation.studies.setup import Setup\n"
        "from coverdrive.simulation.studies.workers import run_trials\n"
        "if __name__ == '__main__':\n"
        f"    list(run_trials(Setup(Witness(), mine.{planner}, 'drivers'), [4, 5], workers=2))\n"
    )
    found = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert found.returncode == 1 and said in found.stderr
    last = found.stderr.splitlines()[-3:]
    assert last[0] == f"this came from the planner mine.{planner}, which is not of coverdrive"
    assert last[1] == STEP[:-2] and last[2] in ("in trial 4 of seed 0", "in trial 5 of seed 0")
