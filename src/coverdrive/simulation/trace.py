"""One episode from start to end: enough to redraw every picture of it, or to replay it.

n steps, m = n + 1 moments, A vehicle slots (the ego's is 0). Step k leads from moment k to moment k + 1.
"""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.paths import PredictedPaths
from coverdrive.planning.plan import Plan
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.outcome import Outcome


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Step:
    """What happened in one step."""

    scene: Scene
    """all vehicles after the step"""
    paths: PredictedPaths
    """what was predicted at the start of the step"""
    plan: Plan
    """what the ego planned against it"""
    base: Int[np.ndarray, " A"]
    """index of the base trajectory that each vehicle follows during the step; −1: none"""
    stuck: Bool[np.ndarray, " A"]
    """whether a vehicle chose at the start of the step and found no choice that passes its check"""
    missed: Bool[np.ndarray, " A"]
    """whether a vehicle chose a base trajectory that the predictor calls impossible"""
    prediction_seconds: float
    """[s] wall time of the prediction"""
    planning_seconds: float
    """[s] wall time of prediction and planning together"""


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
    """[s] wall time of the prediction"""
    planning_seconds: Float[np.ndarray, " n"]
    """[s] wall time of prediction and planning together"""
    outcome: Outcome
    """how it ended"""

    def __len__(self) -> int:
        """Number of steps n."""
        return len(self.plans)

    @property
    def horizon(self) -> float:
        """[s] that is predicted at the start of each step."""
        return self.paths[0].dt * (self.paths[0].points.shape[1] - 1)


def make_trace(start: Scene, road: Road, steps: list[Step], dt: float, outcome: Outcome) -> Trace:
    """Put the steps of an episode, at least one, of ``dt`` [s] each behind one another."""
    scenes = [start, *(step.scene for step in steps)]
    fields = ("lon", "lat", "speed", "heading", "length", "width", "valid")
    return Trace(
        time=dt * np.arange(len(scenes)),
        scene=Scene(**{field: np.stack([getattr(scene, field) for scene in scenes]) for field in fields}),
        road=road,
        paths=tuple(step.paths for step in steps),
        plans=tuple(step.plan for step in steps),
        base=np.stack([step.base for step in steps]),
        stuck=np.stack([step.stuck for step in steps]),
        missed=np.stack([step.missed for step in steps]),
        prediction_seconds=np.array([step.prediction_seconds for step in steps]),
        planning_seconds=np.array([step.planning_seconds for step in steps]),
        outcome=outcome,
    )
