"""One episode: the ego predicts, plans and drives among uncontrolled vehicles, step by step (paper §5).

Every step, all from the same scene: the uncontrolled vehicles' possible paths are predicted, the ego's motion
is planned against them and its first input applied; meanwhile the traffic moves.
"""

import time
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.arguments import shown
from coverdrive.errors import DataError, blaming, during
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Planner, Status
from coverdrive.planning.problem.rollout import after_step
from coverdrive.progress import done
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import Settings
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.trace import Decision, Step, Trace, make_trace
from coverdrive.simulation.predictor import Belief, check_period
from coverdrive.simulation.roads.initial import EGO, InitialSettings, initial_scene
from coverdrive.simulation.traffic.model import Start, Starting, Traffic, TrafficStep
from coverdrive.simulation.traffic.motion import with_states

T = TypeVar("T")

_ROUNDING = 1e-6
"""of a number of steps"""
_MOST = np.array([30.0, 5.0])
"""[m/s²] and [rad/s] more than any car can do"""


class EpisodeSettings(Settings):
    """Length and time steps of an episode."""

    initial: InitialSettings = InitialSettings()
    """road and traffic at the start"""
    duration: float = Field(default=20.0, ge=0.01, le=3600)
    """[s] of an episode without a collision (paper §5)"""
    step: float = Field(default=0.1, ge=0.01, le=0.25)
    """[s] of simulation, between two plans, and between two moments at which contacts are looked for (own choice; the
    authors' scripts plan every 0.05 s)"""

    @property
    def steps(self) -> int:
        """Number of simulation steps of an episode without a collision."""
        return max(1, round(self.duration / self.step))


def run_episode(
    predictor: Belief,
    planner: Planner,
    traffic: Traffic,
    settings: EpisodeSettings,
    vehicles: int,
    seed: int | np.random.SeedSequence,
) -> Trace:
    """Drive until the duration or the recorded traffic is over, or the ego collides.

    The same seed gives the same trace, times of computation excepted.

    Planner and traffic are reset first. ``vehicles`` is the number of uncontrolled ones; ``seed`` is of the start and
    of the traffic. A StartError if they cannot be placed, a SettingError if the predictor learns at another pace.
    """
    check_period(predictor, settings.step)
    scene, road, last = begin(traffic, settings, vehicles, seed)
    with blaming("planner", planner):
        planner.reset(settings.step)
    _predicted(predictor, planner, scene, road)  # compiles before time is taken
    scenes, steps, collision = [scene], list[Step](), None
    for k in range(1, last + 1):
        with during(f"in step {k}, {(k - 1) * settings.step:g} s after the start"):
            steps.append(take_step(predictor, planner, traffic, settings, scenes[-1], road))
        scenes.append(steps[-1].moved.scene)
        done(k, last)
        collision = collision_at(k, scenes, settings.step, road)
        if collision is not None:
            break
    return make_trace(scene, road, steps, settings.step, collision)


def begin(
    traffic: Traffic, settings: EpisodeSettings, vehicles: int, seed: int | np.random.SeedSequence | np.random.Generator
) -> tuple[Scene, Road, int]:
    """Where an episode begins, as of `run_episode`, and how many steps it has unless it ends in a collision.

    A generator draws all itself.
    """
    random, traffic_random = (seed, seed) if isinstance(seed, np.random.Generator) else _generators(seed)
    if isinstance(traffic, Starting):
        with blaming("traffic", traffic):
            start = traffic.start(settings.initial, vehicles, random)
    else:
        start = Start(initial_scene(settings.initial, vehicles, random), settings.initial.road(), np.inf)
    with blaming("traffic", traffic):
        traffic.reset(start.scene, start.road, traffic_random)
    return start.scene, start.road, max(1, int(min(settings.steps, start.duration / settings.step + _ROUNDING)))


def _generators(seed: int | np.random.SeedSequence) -> list[np.random.Generator]:
    """Of the start and of the traffic."""
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    root = np.random.SeedSequence(root.entropy, spawn_key=root.spawn_key)  # the same children however often it is used
    return [np.random.default_rng(each) for each in root.spawn(2)]


def move(scene: Scene, inputs: Float[np.ndarray, " 2"], traffic: Traffic, dt: float) -> TrafficStep:
    """Everybody after ``dt`` [s] in which the ego drove these inputs; a DataError if somebody is nowhere.

    Braking ends at rest: the ego does not go backwards.
    """
    with blaming("traffic", traffic):
        moved = _given(traffic.step(scene, dt), TrafficStep, "step")
        states = moved.scene.states
        _check_shape("states of the scene", states, scene.states.shape)
    if not np.isfinite(states[np.asarray(moved.scene.valid)]).all():
        lost = np.flatnonzero(np.asarray(moved.scene.valid) & ~np.isfinite(states).all(1))[0]
        raise DataError(
            f"traffic {type(traffic).__qualname__} moved vehicle {lost} to the state {states[lost].tolist()}; expected "
            "finite lon [m], lat [m], speed [m/s] and heading [rad]"
        )
    lon, lat, speed, heading = scene.state_of(EGO).tolist()
    acceleration, yaw_rate = inputs.tolist()
    driven = max(acceleration, min(0.0, -speed / dt)), yaw_rate
    states[EGO] = after_step((lon, lat, speed, heading), driven, dt)
    return replace(moved, scene=with_states(moved.scene, states))


def take_step(
    predictor: Belief, planner: Planner, traffic: Traffic, settings: EpisodeSettings, scene: Scene, road: Road
) -> Step:
    """Predict, plan, and move everybody by one simulation step."""
    decision = decide(predictor, planner, scene, road)
    return Step(decision, move(scene, decision.plan.applied(settings.step), traffic, settings.step))


def decide(predictor: Belief, planner: Planner, scene: Scene, road: Road, **wishes: Any) -> Decision:
    """Predict the others and plan the ego's motion; ``wishes`` are further arguments of the planner's.

    Raises:
        DataError: the plan begins with what no car can do, or with no numbers.
    """
    wall, begin = time.perf_counter(), time.process_time()
    paths = _predicted(predictor, planner, scene, road)
    predicted = time.process_time()
    with blaming("planner", planner):
        plan = _given(planner.plan(scene.state_of(EGO), paths, road, **wishes), Plan, "plan")
        _given(plan.status, Status, "status of the plan")
        _check_array("inputs of the plan", plan.inputs)
        _check_shape("states of the plan", plan.states, (len(plan.inputs) + 1, 4))
        _check_array("slack of the plan", plan.slack)
        _check_shape("slack of the plan", plan.slack, (len(plan.inputs),))
        first = np.asarray(plan.inputs)[:1]
        possible = first.shape == (1, 2) and (np.abs(first) <= _MOST).all()
    if not possible:
        raise DataError(
            f"planner {type(planner).__qualname__} asks for {first.tolist()}; expected rows of "
            f"an acceleration of at most {_MOST[0]:g} m/s² and a yaw rate of at most {_MOST[1]:g} rad/s, either way"
        )
    return Decision(paths, plan, predicted - begin, time.process_time() - begin, time.perf_counter() - wall)


def _predicted(predictor: Belief, planner: Planner, scene: Scene, road: Road) -> PredictedPaths:
    """The paths that a planner plans against."""
    with blaming("predictor", predictor):
        paths = _given(predictor.predict(scene, road, EGO, planner.dt, planner.steps), PredictedPaths, "predict")
        _check_array("points of predict", paths.points)
        count = np.shape(paths.points)[:1]
        _check_shape("points", paths.points, (*count, planner.steps + 1, 2))
        _check_shape("half sizes", paths.half_sizes, paths.points.shape)
        _check_shape("vehicles", paths.vehicle, count)
        if paths.ellipses is not None:
            _check_shape("ellipses", paths.ellipses, paths.points.shape)
        if paths.weight is not None:
            _check_shape("weights", paths.weight, count)
        slots = np.asarray(paths.vehicle)
        if len(slots) and not (slots.dtype.kind in "iu" and ((slots > EGO) & (slots < scene.vehicles)).all()):
            raise ValueError(f"expected slots of others, 1 to {scene.vehicles - 1}, as vehicles, got {slots.tolist()}")
        return paths


def _given(value: Any, kind: type[T], name: str) -> T:
    """The value, if it is of a kind; else a TypeError, for which `blaming` names the user's code."""
    if not isinstance(value, kind):
        raise TypeError(f"{name}: expected {kind.__module__}.{kind.__qualname__}, got {shown(value)}")
    return value


def _check_array(name: str, value: Any) -> None:
    """Refuse what is no array, of whatever library."""
    if not (hasattr(value, "shape") and hasattr(value, "tolist")):
        raise TypeError(f"{name}: expected an array, got {shown(value)}")


def _check_shape(name: str, array: Any, expected: tuple[int, ...]) -> None:
    """Refuse what is not an array of a shape."""
    if np.shape(array) != expected:
        raise ValueError(f"expected {name} of the shape {expected}, got {np.shape(array)}")
