"""One episode from start to end: enough to redraw every picture of it, or to replay it.

n steps, m = n + 1 moments, A vehicle slots (the ego's is 0). Step k leads from moment k to moment k + 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.paths import PredictedPaths, together
from coverdrive.plan import Plan, Status
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Kind, Outcome
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.model import TrafficStep


class Decision(NamedTuple):
    """What the ego made of a scene, in the terms of `Trace`."""

    paths: PredictedPaths
    plan: Plan
    prediction_seconds: float = 0.0
    planning_seconds: float = 0.0
    wall_seconds: float = 0.0


def driven(before: Scene, after: Scene, inputs: Float[np.ndarray, "1 2"], dt: float, seconds: float = 0.0) -> Plan:
    """A step of the ego as the plan of it: of somebody who does not say what he plans, and promises nothing."""
    states = np.stack([before.states[EGO], after.states[EGO]])
    return Plan(states, inputs, np.zeros(1), Status.INVALID_INPUT, 0.0, seconds, dt)


class Step(NamedTuple):
    """What happened in one step."""

    decision: Decision
    moved: TrafficStep
    """all vehicles after the step, the ego included"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Trace:
    """One episode."""

    time: Float[np.ndarray, " m"]
    """[s]"""
    scene: Scene
    """all vehicles at every moment, leading axis m"""
    road: Road
    """on which it took place"""
    paths: tuple[PredictedPaths, ...]
    """what was predicted at the start of each step"""
    plans: tuple[Plan, ...]
    """what the ego planned at the start of each step"""
    base: Int[np.ndarray, "n A"]
    """index of the base trajectory that each vehicle follows; −1: none"""
    stuck: Bool[np.ndarray, "n A"]
    """whether a vehicle chose at the start of the step and found no choice that passes its check"""
    missed: Bool[np.ndarray, "n A"]
    """whether a vehicle chose a base trajectory that the predictor calls impossible"""
    prediction_seconds: Float[np.ndarray, " n"]
    """[s] processor time of the prediction"""
    planning_seconds: Float[np.ndarray, " n"]
    """[s] processor time of prediction and planning together"""
    wall_seconds: Float[np.ndarray, " n"]
    """[s] wall time of the same, which grows with whatever else the machine does"""
    outcome: Outcome
    """how it ended"""

    def __len__(self) -> int:
        """Number of steps n."""
        return len(self.plans)

    def __repr__(self) -> str:
        """How it went, in short."""
        return f"<Trace of {len(self)} steps: {self.outcome}>"

    @cached_property
    def all_paths(self) -> tuple[Int[np.ndarray, " S"], PredictedPaths]:
        """The paths of all steps behind one another, and the step at whose start each of them was predicted."""
        counts = [len(each) for each in self.paths]
        return np.repeat(np.arange(len(counts)), counts), together(self.paths)

    @property
    def horizon(self) -> float:
        """[s] that is predicted at the start of each step."""
        return self.paths[0].dt * (self.paths[0].points.shape[1] - 1)


def make_trace(start: Scene, road: Road, steps: Sequence[Step], dt: float, collision: Outcome | None = None) -> Trace:
    """Put the steps of an episode, at least one, of ``dt`` [s] each behind one another, with how it ended, if early."""
    decisions, moves = zip(*steps, strict=True)
    paths, plans, *seconds = zip(*decisions, strict=True)
    prediction_seconds, planning_seconds, wall_seconds = map(np.array, seconds)
    moments = zip(*(vars(each).values() for each in (start, *(moved.scene for moved in moves))), strict=True)
    return Trace(
        time=dt * np.arange(len(steps) + 1),
        scene=Scene(*map(np.stack, moments)),
        road=road,
        paths=paths,
        plans=plans,
        base=np.stack([moved.base for moved in moves]),
        stuck=np.stack([moved.stuck for moved in moves]),
        missed=np.stack([moved.missed for moved in moves]),
        prediction_seconds=prediction_seconds,
        planning_seconds=planning_seconds,
        wall_seconds=wall_seconds,
        outcome=collision or Outcome(Kind.FINISHED, len(steps) * dt),
    )
