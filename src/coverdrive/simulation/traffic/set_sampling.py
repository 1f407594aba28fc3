"""The paper's traffic: every vehicle drives a random member of its own predicted set (paper §5).

Every 0.3 s the uncontrolled vehicles choose anew, one after the other in random order: uniformly among the base
trajectories that the predictor calls possible and that pass the collision check, over the whole horizon, against
the other uncontrolled vehicles' chosen paths and the road's edges. Those that have not chosen yet are taken on their
previous choice. The ego is taken into account at constant velocity, and only by a vehicle that has it directly in
front. To the check, bodies are boxes along the road that hold the turned vehicles, and lanes that end are none: a set
need not lead out of them.

A slots, M base trajectories or paths, B other vehicles, n times from now to the end of the horizon.
"""

import math
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.errors import SettingError, blaming
from coverdrive.geometry import turned_extents
from coverdrive.prediction.cover.motion import follow
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import Settings
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.roads.course import Course
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.model import TrafficStep
from coverdrive.simulation.traffic.motion import constant_velocity, with_states

_turned_extents = compiled(turned_extents)


class SetSamplingSettings(Settings):
    """The paper's traffic: vehicles that drive random members of their own predicted sets."""

    kind: Literal["set-sampling"] = "set-sampling"
    """name of this traffic"""
    interval: float = Field(default=0.3, ge=0.01, le=60)
    """[s] between two choices of a vehicle (authors' scripts)"""


class SetSamplingTraffic:
    """Uncontrolled vehicles that follow base trajectories drawn from their predicted sets."""

    def __init__(self, predictor: Predictor, settings: SetSamplingSettings | None = None):
        """Take the sets from ``predictor``; call `reset` before the first step."""
        self._predictor = predictor
        self._settings = settings or SetSamplingSettings()

    def reset(
        self, scene: Scene, road: Road, rng: np.random.Generator, controlled: Bool[np.ndarray, " A"] | None = None
    ) -> None:
        """Begin with every vehicle at constant velocity; all choose in the first step.

        ``controlled`` are the slots that this model moves, if not all but the ego's; vehicles of other models are taken
        into account at constant velocity.
        """
        self._road, self._through, self._rng = road, Course(road).through, rng
        self._controlled = np.arange(scene.vehicles) != EGO if controlled is None else controlled
        self._age = 0
        self._paths = scene.states[:, None]
        self._base = np.full(scene.vehicles, -1)

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Choose if it is time to, then move everybody; a SettingError if ``dt`` does not divide the interval."""
        steps = round(self._settings.interval / dt)
        if steps < 1 or not math.isclose(steps * dt, self._settings.interval, rel_tol=1e-5):
            raise SettingError(
                f"vehicles choose every {self._settings.interval} s, which is not a multiple of the simulation step "
                f"of {dt} s; change one of the two"
            )
        stuck, missed = np.zeros((2, scene.vehicles), dtype=bool)
        if self._age % steps == 0:
            stuck, missed = self._choose(scene, dt)
        self._age += 1
        states = self._paths[:, self._age].copy()
        states[~self._controlled] = scene.states[~self._controlled]
        return TrafficStep(with_states(scene, states), self._base.copy(), stuck, missed)

    def _choose(self, scene: Scene, dt: float) -> tuple[Bool[np.ndarray, " A"], Bool[np.ndarray, " A"]]:
        """Give every valid vehicle a new base trajectory; tell who was stuck, and who left its predicted set."""
        with blaming("predictor", self._predictor):
            times = dt * np.arange(round(self._predictor.horizon / dt) + 1)
            deviation, rate, possible = self._predictor.choices(scene, self._road, times)
        heeds_own = directly_in_front(scene, self._road)
        self._begin_choice(scene, times)
        half_sizes, (stuck, missed) = scene.half_sizes, np.zeros((2, scene.vehicles), dtype=bool)
        for slot in self._rng.permutation(np.flatnonzero(scene.valid & self._controlled)).tolist():
            paths = follow(self._paths[slot, 0], times, deviation[slot], rate[slot])
            others = scene.valid & (np.arange(scene.vehicles) != slot)
            others[EGO] &= heeds_own[slot]
            apart = clearance(paths[:, 1:], half_sizes[slot], self._paths[others, 1:], half_sizes[others])
            clear = np.minimum(apart, road_clearance(paths, half_sizes[slot], self._through))
            base, stuck[slot] = self._pick(possible[slot], clear, deviation[slot])
            missed[slot] = not possible[slot, base]
            self._base[slot] = base
            self._paths[slot] = paths[base]
        return stuck, missed

    def _begin_choice(self, scene: Scene, times: Float[np.ndarray, " n"]) -> None:
        """Let the paths begin now: previous choices go on at constant velocity, and so does whom others move."""
        left = self._paths[:, self._age :]
        missing = len(times) - left.shape[1]
        beyond = constant_velocity(left[:, -1], times[1 : missing + 1])
        self._paths = np.concatenate([left, beyond], axis=1)
        self._paths[~self._controlled] = constant_velocity(scene.states[~self._controlled], times)
        self._age = 0

    def _pick(
        self, possible: Bool[np.ndarray, " M"], clear: Float[np.ndarray, " M"], deviation: Float[np.ndarray, "M n 2"]
    ) -> tuple[int, bool]:
        """A random base trajectory that is possible and passes the check; else the least bad one, and True.

        The least bad one is the possible one of largest clearance; if none is possible, the hardest braking.
        """
        passing = np.flatnonzero(possible & (clear > 0))
        if len(passing) > 0:
            return int(self._rng.choice(passing)), False
        if possible.any():
            return int(np.argmax(np.where(possible, clear, -np.inf))), True
        return int(np.argmin(deviation[:, -1, 0])), True


def clearance(
    paths: Float[np.ndarray, "M n 4"],
    half_size: Float[np.ndarray, " 2"],
    others: Float[np.ndarray, "B n 4"],
    half_sizes: Float[np.ndarray, "B 2"],
) -> Float[np.ndarray, " M"]:
    """Least distance [m] of a vehicle's paths to all others at the same times; infinite without any.

    It is that along lon or lat, whichever is larger; negative where bodies overlap.
    """
    result = np.full(len(paths), np.inf)
    _lower_to_gaps(np.ascontiguousarray(paths), half_size, np.ascontiguousarray(others), half_sizes, result)
    return result


@compiled
def _lower_to_gaps(
    paths: Float[np.ndarray, "M n 4"], half_size: Float[np.ndarray, " 2"], others: Float[np.ndarray, "B n 4"],
    half_sizes: Float[np.ndarray, "B 2"], least: Float[np.ndarray, " M"],
) -> None:  # fmt: skip
    """Lower numbers to the least gaps of a vehicle's paths and others at any time."""
    extent = np.empty((len(paths), paths.shape[1], 2))
    for m in range(len(paths)):
        for k in range(paths.shape[1]):
            extent[m, k, 0], extent[m, k, 1] = _turned_extents(half_size[0], half_size[1], paths[m, k, 3])
    for b in range(len(others)):
        for k in range(paths.shape[1]):
            long, wide = _turned_extents(half_sizes[b, 0], half_sizes[b, 1], others[b, k, 3])
            for m in range(len(paths)):
                along = abs(paths[m, k, 0] - others[b, k, 0]) - (extent[m, k, 0] + long)
                across = abs(paths[m, k, 1] - others[b, k, 1]) - (extent[m, k, 1] + wide)
                least[m] = min(least[m], max(along, across))


def road_clearance(
    paths: Float[np.ndarray, "M n 4"], half_size: Float[np.ndarray, " 2"], road: Road
) -> Float[np.ndarray, " M"]:
    """How far every path stays on the road [m]; negative: the body leaves it, further than it is off at the start."""
    result = np.empty(len(paths))
    _write_room(np.ascontiguousarray(paths), half_size, road.edges_at(paths[..., 0]), result)
    return result


@compiled
def _write_room(
    paths: Float[np.ndarray, "M n 4"], half_size: Float[np.ndarray, " 2"], edges: Float[np.ndarray, "M n E"],
    result: Float[np.ndarray, " M"],
) -> None:  # fmt: skip
    """Write what `road_clearance` returns, given the lane edges beside every path."""
    for m in range(len(paths)):
        start, least = 0.0, np.inf
        for k in range(paths.shape[1]):
            lat, aside = paths[m, k, 1], _turned_extents(half_size[0], half_size[1], paths[m, k, 3])[1]
            inside = min(lat - aside - edges[m, k, 0], edges[m, k, -1] - lat - aside)
            if k == 0:
                start = min(inside, 0.0)
            else:
                least = min(least, inside)
        result[m] = least - start


def directly_in_front(scene: Scene, road: Road) -> Bool[np.ndarray, " A"]:
    """Whether the ego is the nearest vehicle ahead in the same lane, for every slot."""
    lane = road.lane_at(scene.lon, scene.lat)
    ahead = np.asarray(scene.lon) - np.asarray(scene.lon)[:, None]
    candidate = (lane == lane[:, None]) & (ahead > 0) & scene.valid
    ahead = np.where(candidate, ahead, np.inf)
    return candidate[:, EGO] & (ahead[:, EGO] == ahead.min(1))
