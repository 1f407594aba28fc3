"""A small hand-made drive, and small bases."""

import jax
import numpy as np

from coverdrive.paths import PredictedPaths
from coverdrive.planning.plan import Plan, Status
from coverdrive.prediction.basis import Basis
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.outcome import Fault, Kind, Outcome
from coverdrive.simulation.trace import Trace

STEPS, HORIZON = 12, 4
PATHS_PER_VEHICLE = 3


def scenes(steps: int) -> Scene:
    """The own car at 24 m/s, one vehicle at 20 m/s ahead in its lane, one beside it; the last slot is empty.

    The own car moves to the left at 0.5 m per step, so that its centre crosses into lane 1 in step 4, and it passes
    the vehicle beside it in step 8.
    """
    moment = np.arange(steps + 1)
    constant = np.ones_like(moment)[:, None]
    lon = np.stack([2.4 * moment, 40 + 2.0 * moment, 3.4 + 2.0 * moment, 0 * moment], axis=-1)
    lat = np.stack([-0.45 + 0.5 * moment + 1.8, 1.8 + 0 * moment, 9.0 + 0 * moment, 0 * moment], axis=-1)
    return Scene(
        lon=lon,
        lat=lat,
        speed=constant * np.array([24.4, 20.0, 19.6, 0.0]),
        heading=constant * np.array([0.2, 0.0, 0.0, 0.0]),
        length=constant * np.array([5.0, 4.0, 4.0, 4.0]),
        width=constant * np.array([2.0, 2.0, 2.0, 2.0]),
        valid=np.broadcast_to([True, True, True, False], (steps + 1, 4)),
    )


def predicted(scene: Scene) -> PredictedPaths:
    """Three paths for each of the vehicles 1 and 2, at 0, 0.5, … s."""
    vehicle = np.repeat([1, 2], PATHS_PER_VEHICLE)
    times = 0.5 * np.arange(HORIZON + 1)
    drift = np.tile([-1.0, 0.0, 1.0], 2)[:, None]
    lon = scene.lon[vehicle, None] + scene.speed[vehicle, None] * times
    lat = scene.lat[vehicle, None] + drift * times
    half_sizes = np.broadcast_to([2.5, 1.2], (len(vehicle), HORIZON + 1, 2))
    return PredictedPaths(np.stack([lon, lat], axis=-1), vehicle, half_sizes, 0.5)


def planned(scene: Scene, status: Status) -> Plan:
    """Straight on for two seconds."""
    times = 0.5 * np.arange(HORIZON + 1)
    states = np.tile([scene.lon[0], scene.lat[0], scene.speed[0], 0.0], (len(times), 1))
    states[:, 0] += scene.speed[0] * times
    return Plan(states, np.zeros((HORIZON, 2)), np.zeros(HORIZON), status, cost=0.0, seconds=0.01, dt=0.5)


def make_trace(steps: int = STEPS, kind: Kind = Kind.FINISHED) -> Trace:
    """A drive of 0.1 s steps whose plans were found in every possible way in turn."""
    scene = scenes(steps)
    moments = [jax.tree.map(lambda values, k=k: values[k], scene) for k in range(steps)]
    statuses = list(Status)
    seconds = 0.01 + 0.001 * np.arange(steps)
    nothing = np.zeros((steps, 4), dtype=bool)
    collided = kind is not Kind.FINISHED
    return Trace(
        time=0.1 * np.arange(steps + 1),
        scene=scene,
        road=Road.straight(),
        paths=tuple(predicted(moment) for moment in moments),
        plans=tuple(planned(moment, statuses[k % len(statuses)]) for k, moment in enumerate(moments)),
        base=np.zeros((steps, 4), dtype=int),
        stuck=nothing,
        missed=nothing,
        prediction_seconds=seconds / 2,
        planning_seconds=seconds,
        outcome=Outcome(kind, 0.1 * steps, 1 if collided else None, Fault.OTHER if collided else Fault.NONE),
    )


def make_basis(size: int, seed: int = 0) -> Basis:
    """Base trajectories of constant acceleration and lateral speed."""
    random = np.random.default_rng(seed)
    times = 0.5 * np.arange(7)
    acceleration, drift = random.normal(0, 1, size), random.normal(0, 0.6, size)
    points = np.stack([acceleration[:, None] * times**2 / 2, drift[:, None] * times], axis=-1)
    return Basis(points, epsilon=0.5, aspect=4.0, growth=1.0, step=0.5)
