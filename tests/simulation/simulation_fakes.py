"""Small stand-ins for a predictor and planners, and hand-made scenes."""

from dataclasses import dataclass

import numpy as np

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.problem.rollout import after_step
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.replay import Scenario


@dataclass(frozen=True, eq=False)
class FakeBasis:
    """Constant acceleration with a smooth shift across the road; every combination is one base trajectory."""

    acceleration: np.ndarray
    shift: np.ndarray
    horizon: float = 3.0

    @staticmethod
    def make(accelerations=(0.0, 1.0, -1.0, -3.0), shifts=(0.0, 3.6, -3.6)) -> "FakeBasis":
        grid = np.stack(np.meshgrid(accelerations, shifts, indexing="ij"), -1).reshape(-1, 2)
        return FakeBasis(grid[:, 0], grid[:, 1])

    def rollout(self, times):
        s = times / self.horizon
        lon = 0.5 * self.acceleration[:, None] * times**2
        lat = self.shift[:, None] * (3 * s**2 - 2 * s**3)
        rate = np.stack([self.acceleration[:, None] * times, self.shift[:, None] * 6 * (s - s**2) / self.horizon], -1)
        return np.stack([lon, lat], -1), rate


@dataclass(frozen=True, eq=False)
class FakePredictor:
    """Every vehicle may follow every base trajectory, except those named impossible."""

    basis: FakeBasis
    impossible: tuple[int, ...] = ()

    def possible(self, scene, road):
        verdict = np.ones((scene.vehicles, len(self.basis.shift)), dtype=bool)
        verdict[:, list(self.impossible)] = False
        return verdict

    @property
    def horizon(self):
        return self.basis.horizon

    def choices(self, scene, road, times):
        deviation, rate = (np.broadcast_to(each, (scene.vehicles, *each.shape)) for each in self.basis.rollout(times))
        return deviation, rate, self.possible(scene, road)

    def predict(self, scene, road, ego, dt, steps):
        times = dt * np.arange(steps + 1)
        deviation, _ = self.basis.rollout(times)
        possible = self.possible(scene, road)
        possible[ego] = possible[~scene.valid] = False
        vehicle, base = np.nonzero(possible)
        points = np.repeat(scene.states[vehicle, None, :2], steps + 1, axis=1) + deviation[base]
        points[..., 0] += scene.speed[vehicle, None] * times
        shape = (len(vehicle), steps + 1, 2)
        sizes = scene.half_sizes[vehicle, None]
        return PredictedPaths(points, vehicle, np.broadcast_to(sizes, shape).copy(), dt)


class ConstantPlanner:
    """Applies the same input always."""

    def __init__(self, acceleration=0.0, yaw_rate=0.0):
        self.inputs = np.tile([acceleration, yaw_rate], (12, 1))
        self.resets = 0

    dt, steps = 0.25, 12

    def reset(self, period):
        self.resets += 1

    def plan(self, state, paths, road):
        states = [tuple(state.tolist())]
        for applied in self.inputs.tolist():
            states.append(after_step(states[-1], tuple(applied), self.dt))
        return Plan(np.array(states), self.inputs, np.zeros(12), Status.SOLVED, cost=1.0, seconds=0.0, dt=0.25)


def make_scene(lon, lat, speed=None, heading=None) -> Scene:
    """Vehicles of 4.8 m × 1.9 m."""
    lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
    return Scene(
        lon=lon,
        lat=lat,
        speed=np.full(lon.shape, 20.0) if speed is None else np.asarray(speed, dtype=float),
        heading=np.zeros(lon.shape) if heading is None else np.asarray(heading, dtype=float),
        length=np.full(lon.shape, 4.8),
        width=np.full(lon.shape, 1.9),
        valid=np.ones(lon.shape, dtype=bool),
    )


FAST = EpisodeSettings(duration=1.0)
"""a short episode"""


def fakes(planner=ConstantPlanner, **changes) -> Setup:
    """A short study with stand-ins."""
    return Setup(FakePredictor(FakeBasis.make()), planner, episode=FAST, **changes)


def make_scenario() -> Scenario:
    """Recorded for 10 s: two vehicles that follow each other at 20 m/s, 40 m apart."""
    moment = np.arange(101)[:, None]
    lon, lat = 2.0 * moment + np.array([0.0, 40.0]), np.full((101, 2), 1.8)
    states = np.stack([lon, lat, np.full_like(lon, 20.0), np.zeros_like(lon)], axis=-1)
    sizes, valid = np.tile([4.8, 1.9], (2, 1)), np.ones((101, 2), dtype=bool)
    return Scenario(states, sizes, valid, 0.1, Road.straight())


REPLAYED = {"traffic": "replay", "scenarios": (make_scenario(),)}
"""what makes `fakes` a study of replays"""
