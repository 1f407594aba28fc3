"""Agents: whoever says what to do in a scene, without paths to plan against, drives in every world as planners do."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.vehicle import step
from coverdrive.road import Road
from coverdrive.scene import Scene


@runtime_checkable
class Agent(Protocol):
    """Drives a car that it sees from above, the ego in slot 0 of the scene."""

    def reset(self, period: float) -> None:
        """Forget the last drive; the next one asks every ``period`` [s]."""
        ...

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        """Acceleration [m/s²] and yaw rate [rad/s] in the frame of the road until the next call."""
        ...


class Witness:
    """Believes that everybody keeps the velocity, and remembers what it saw last."""

    fingerprint = ConstantVelocity().fingerprint

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """As the constant velocities of bodies."""
        self.scene = scene
        return ConstantVelocity().predict(scene, road, ego, dt, steps)


class AgentPlanner:
    """An agent as a planner: what it does now, held for the whole horizon, without knowing of any path."""

    dt, steps = 0.25, 12

    def __init__(self, agent: Agent, witness: Witness):
        """Show an agent what the witness sees, which has to be the belief that it drives with."""
        self.agent, self._witness = agent, witness

    def reset(self, period: float) -> None:
        """`Agent.reset`."""
        self.agent.reset(period)

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """What the agent does in the scene that was seen last."""
        inputs = np.tile(np.array(self.agent.act(self._witness.scene, road), dtype=float), (self.steps, 1))
        states = [state]
        for each in inputs:
            states.append(step(states[-1], each, self.dt))
        return Plan(np.array(states), inputs, np.zeros(self.steps), Status.INVALID_INPUT, 0.0, 0.0, self.dt)
