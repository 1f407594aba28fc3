"""Random scenes, plans driven by finer steps than planned, and contact by dense sampling: what the planner may not do.

m plans, K steps, S paths, P = K + 1 states, T samples in time.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.geometry import boxes_overlap
from coverdrive.paths import PredictedPaths
from coverdrive.planning.check.evaluate import Plans, drive_step, empty_plans
from coverdrive.planning.problem.constants import Constants, constants_of
from coverdrive.planning.problem.obstacles import obstacles_of, reachable
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import VehicleSettings, step
from coverdrive.planning.solver.search import EVALUATE, Wanted, search
from coverdrive.planning.surroundings import Surroundings
from coverdrive.road import Road
from coverdrive.road_ahead import STRAIGHT, RoadAhead

PROBLEM, CAR = ProblemSettings(), VehicleSettings()
STEPS, DT, PERIOD = PROBLEM.steps, PROBLEM.dt, 0.1
CONSTANTS = constants_of(PROBLEM, PERIOD)
EDGES = np.array([0.0, 10.8])
OPEN = np.array([-50.0, 60.0])
SIZES = np.array([[1.1, 0.4], [2.3, 0.9], [6.0, 1.3]])
"""[m] half sizes of a motorcycle, a car and a truck"""
WAYS = ((1, 20), (5, 4), (25, 1))
"""parts of a step that a plan is driven by, and samples between their ends"""


def between(right: float, left: float) -> RoadAhead:
    """A straight road between two edges [m]."""
    return table_of(Road(np.array([right, left]), 1000.0), PROBLEM).road


WANTED = np.full(STEPS + 1, PROBLEM.cost.reference_speed)
"""[m/s] at every moment"""


def smallest_slack(values: Float[np.ndarray, "*m K n"], margin: float) -> Float[np.ndarray, "*m K"]:
    """The smallest slack γ_k of every step with which constraints of these left-hand sides hold, margin included."""
    return np.maximum(0.0, 1.0 + margin - values.min(axis=-1, initial=1.0 + margin))


def scene(rng: np.random.Generator, vehicles: int = 3) -> tuple[np.ndarray, PredictedPaths]:
    """A state and paths of vehicles that stand, drive, cross, come from behind or towards the ego, and swerve.

    The ego is up to 45 m/s fast and closes in at up to 90 m/s; most would meet it within the plan but for some metres.
    """
    speed, time = rng.uniform(0, 45), DT * np.arange(STEPS + 1)
    state = np.array([rng.uniform(-100, 100), rng.uniform(1.0, 9.8), speed, rng.uniform(-0.2, 0.2)])
    along = np.where(rng.random(vehicles) < 0.3, 0.0, rng.uniform(-45, 45, vehicles))
    across = np.where(rng.random(vehicles) < 0.6, 0.0, rng.uniform(-10, 10, vehicles))
    meeting, near = rng.uniform(0, 3, vehicles), rng.choice([0.3, 1.0], vehicles)
    lon = state[0] + (speed - along) * meeting + near * rng.uniform(-30, 30, vehicles)
    lat = state[1] - across * meeting + near * rng.uniform(-6, 6, vehicles)
    swerve = rng.normal(0, 0.2, (vehicles, len(time), 2)).cumsum(1)
    points = np.stack([lon[:, None] + along[:, None] * time, lat[:, None] + across[:, None] * time], axis=-1) + swerve
    half_sizes = rng.choice(SIZES, vehicles)[:, None] + 0.05 * np.arange(len(time))[:, None]
    return state, PredictedPaths(points, np.arange(vehicles), half_sizes, DT)


def around(state: np.ndarray, paths: PredictedPaths, edges: np.ndarray = EDGES) -> Surroundings:
    """What a plan is made for, packed as the planner does; all paths are likely."""
    boxes, _ = obstacles_of(paths, PROBLEM.obstacles)
    boxes = boxes.compress(reachable(state, boxes, DT, CAR, PROBLEM.obstacles), axis=2)
    boxes[0] -= state[0]
    return Surroundings(np.array([0.0, *state[1:]]), np.zeros(2), between(*edges), WANTED, boxes, boxes)


def wishes(rng: np.random.Generator, plans: int, nodes: int = len(CONSTANTS.tree.parent)) -> np.ndarray:
    """Inputs (m, N, 2) of all sizes, some steady and some not."""
    wild = rng.normal(0, [5.0, 0.2], (plans, nodes, 2))
    steady = np.repeat(rng.normal(0, [4.0, 0.1], (plans, 1, 2)), nodes, axis=1)
    return np.where(rng.random((plans, 1, 1)) < 0.5, wild, steady)


def evaluated(
    inputs: np.ndarray, surroundings: Surroundings, target: float = 5.4, constants: Constants = CONSTANTS
) -> Plans:
    """Plans of wished inputs (m, N, 2), evaluated: as starts of a search, which is compiled anyway."""
    nodes, nothing = inputs.shape[1], np.zeros(len(inputs) - 1)
    last, rest = np.zeros((len(nothing), nodes, 2)), np.zeros((constants.steps, 2))
    plans = empty_plans(len(inputs) + 1, nodes)
    plans.inputs[1:], plans.targets[1:] = inputs, target
    wanted = Wanted(nothing, 0, nothing, last, rest, np.zeros(0))
    for i in range(1, len(plans.cost)):
        search(EVALUATE, plans, wanted, surroundings, constants, i)
    return Plans(*(each[1:] for each in plans))


def drive(state: np.ndarray, wishes: np.ndarray, before: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, ...]:
    """States (m, P, 4) and inputs (m, K, 2) of cars that follow wishes (m, K, 2) within the limits, step by step."""
    inputs, states = np.empty_like(wishes), np.empty((len(wishes), wishes.shape[1] + 1, 4))
    for i, wanted in enumerate(wishes):
        states[i, 0], last, elapsed = state, before, PERIOD
        for k, wish in enumerate(wanted):
            last, after = drive_step(
                tuple(states[i, k]), (float(wish[0]), float(wish[1])), last, elapsed, DT, STRAIGHT, CONSTANTS.vehicle
            )
            inputs[i, k], states[i, k + 1], elapsed = last, after, DT
    return states, inputs


def rollout(state: np.ndarray, inputs: np.ndarray, dt: float = DT) -> np.ndarray:
    """The states (P, 4) that inputs (K, 2), each held for dt, lead to; the first is the given one."""
    states = [np.asarray(state, dtype=float)]
    for applied in inputs:
        states.append(step(states[-1], applied, dt))
    return np.stack(states)


def whole(inputs: np.ndarray) -> np.ndarray:
    """The same inputs (K, 2) on both branches, as one plan (1, N, 2)."""
    return inputs[CONSTANTS.tree.moment - 1][None]


def fail_safe(plans: Plans) -> np.ndarray:
    """Inputs (m, K, 2) of the fail-safe branches."""
    return plans.inputs[:, CONSTANTS.tree.fail_safe]


def driven(state: np.ndarray, inputs: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (T) and states (m, T, 4) of inputs (m, K, 2) from one state or one for each, by steps of dt / parts."""
    states = [np.broadcast_to(state, (len(inputs), 4))]
    for k in range(inputs.shape[1]):
        for _ in range(parts):
            states.append(step(states[-1], inputs[:, k], DT / parts))
    return DT / parts * np.arange(len(states)), np.stack(states, axis=1)


def sampled(values: np.ndarray, samples: int) -> np.ndarray:
    """Values (…, T, n), and others between any two of them in even steps: ``samples`` for each."""
    share = np.arange(samples)[:, None] / samples
    between = values[..., :-1, None, :] + share * (values[..., 1:, None, :] - values[..., :-1, None, :])
    joined = between.reshape(*values.shape[:-2], -1, values.shape[-1])
    return np.concatenate([joined, values[..., -1:, :]], axis=-2)


def touches(states: np.ndarray, points: np.ndarray, half_sizes: np.ndarray, samples: int) -> np.ndarray:
    """Which plans (m) touch a box at any of some samples between two of their states (m, T, 4).

    The points and half sizes of the boxes are (S, P, 2) for all plans, or (m, S, P, 2).
    """
    own = sampled(states, samples)[:, None]
    each = (own.shape[2] - 1) // STEPS
    points, half_sizes = sampled(points, each), sampled(half_sizes, each)
    reach = half_sizes + np.hypot(*CAR.half_sizes)
    near = np.nonzero((np.abs(points - own[..., :2]) <= reach).all(-1))
    own = own[near[0], 0, near[2]]
    points, half_sizes = (np.broadcast_to(each, (len(states), *each.shape[-3:]))[near] for each in (points, half_sizes))
    touching = boxes_overlap(own[:, :2], own[:, 3], CAR.half_sizes, points, np.zeros(len(points)), half_sizes)
    return np.bincount(near[0][touching], minlength=len(states)) > 0
