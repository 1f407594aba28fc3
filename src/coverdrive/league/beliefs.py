"""What an ego may believe instead of certified sets: baselines, and the limit of knowledge.

All look ahead from one scene, as predictors do. A body is taken as straight along the road, unless it is known how it
turns. P points after the start, K steps.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from coverdrive.certificates.certificate import Certificate, fingerprint
from coverdrive.errors import DataError
from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.stored import others_of
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.traffic.replay import Scenario, hash_of_scenarios

_SAME = 1e-6
"""[m, m/s, rad] states that differ by less are the same"""


@dataclass(frozen=True, eq=False)
class ConstantVelocity:
    """Everybody keeps the speed along the road and the place across it, within a box of one size for all."""

    beyond: Float[np.ndarray, "P 2"] = field(default_factory=lambda: np.zeros((1, 2)))
    """[m] half sizes of the box beyond those of the body; zero for the body alone"""
    step: float = 1.0
    """[s] between two of them"""
    now: Float[np.ndarray, " 2"] = field(default_factory=lambda: np.zeros(2))
    """[m] the same of the box of now"""
    claim: Certificate | None = None
    """what is proved of the boxes, if anything is"""

    @property
    def fingerprint(self) -> str:
        """A short hash."""
        return f"constant velocity {fingerprint(self.beyond, np.array(self.step), self.now)}"

    def scaled(self, scale: float) -> "ConstantVelocity":
        """The same with boxes of another size, of which nothing is proved."""
        return replace(self, beyond=scale * self.beyond, now=scale * self.now, claim=None)

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """One path for each vehicle; boxes grow linearly between the times at which their sizes are given."""
        vehicle, times = np.flatnonzero(others_of(scene, ego)), dt * np.arange(steps + 1)
        states = scene.states[vehicle]
        points = np.repeat(states[:, None, :2], len(times), axis=1)
        points[..., 0] += times * (states[:, 2] * np.cos(states[:, 3]))[:, None]
        knots = self.step * np.arange(len(self.beyond) + 1)
        sizes = np.vstack([self.now, self.beyond]).T
        beyond = np.stack([np.interp(times, knots, each) for each in sizes], axis=-1)
        return PredictedPaths(points, vehicle, scene.half_sizes[vehicle][:, None] + beyond, dt)


@dataclass(frozen=True, eq=False)
class KnownFuture:
    """In replayed traffic, what recorded vehicles will do: their bodies, turned as they will be.

    Beyond the last recorded moment of a vehicle, it keeps its velocity. Scenes are found again by the states in them;
    a DataError if a scene is not one of the recorded moments.
    """

    scenarios: Sequence[Scenario]

    @property
    def fingerprint(self) -> str:
        """A short hash."""
        return f"known future {hash_of_scenarios(self.scenarios)}"

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """One path for each vehicle, interpolated between recorded moments as the replay is."""
        vehicle, times = np.flatnonzero(others_of(scene, ego)), dt * np.arange(steps + 1)
        if len(vehicle) == 0:
            return PredictedPaths(np.empty((0, steps + 1, 2)), vehicle, np.empty((0, steps + 1, 2)), dt)
        scenario, first, slot = self._found(scene, vehicle)
        there = np.logical_and.accumulate(scenario.valid[first:, slot])
        moment = np.minimum(times[:, None] / scenario.dt, there.sum(0) - 1)
        before, after = np.floor(moment + _SAME).astype(int), np.ceil(moment - _SAME).astype(int)
        share, states = (moment - before)[..., None], scenario.states[first:, slot]
        row = np.arange(len(vehicle))
        known = (1 - share) * states[before, row] + share * states[after, row]
        lon, lat, speed, heading = np.moveaxis(known, -1, 0)
        left = times[:, None] - moment * scenario.dt
        points = np.stack([lon + left * speed * np.cos(heading), lat + left * speed * np.sin(heading)], axis=-1)
        half_sizes = turned_half_extents(scene.half_sizes[vehicle], heading)
        return PredictedPaths(points.swapaxes(0, 1), vehicle, half_sizes.swapaxes(0, 1), dt)

    def _found(self, scene: Scene, vehicle: Int[np.ndarray, " n"]) -> tuple[Scenario, int, Int[np.ndarray, " n"]]:
        """The scenario and the moment in which all these vehicles are, and their slots there."""
        tree, places = self._index
        seen = np.concatenate([scene.states, scene.half_sizes], axis=1)[vehicle]
        found = [places[each] for each in tree.query_ball_point(seen, _SAME)]
        moments = Counter((number, moment) for each in found for number, moment in each[:, :2].tolist())
        best, count = moments.most_common(1)[0] if moments else ((0, 0), 0)
        if count < len(vehicle):
            raise DataError(f"only {count} of {len(vehicle)} vehicles of a scene are together in a recorded moment")
        slots = [each[(each[:, :2] == best).all(1), 2][0] for each in found]
        return self.scenarios[best[0]], best[1], np.array(slots)

    @cached_property
    def _index(self) -> tuple[KDTree, Int[np.ndarray, "N 3"]]:
        """All recorded states with half sizes, and their scenarios, moments and slots."""
        rows, places = list[np.ndarray](), list[np.ndarray]()
        for number, each in enumerate(self.scenarios):
            moment, slot = np.nonzero(each.valid)
            rows.append(np.concatenate([each.states[moment, slot], each.sizes[slot] / 2], axis=1))
            places.append(np.stack([np.full(len(moment), number), moment, slot], axis=1))
        return KDTree(np.concatenate(rows)), np.concatenate(places)
