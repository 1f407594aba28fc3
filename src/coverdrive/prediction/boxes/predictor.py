"""The predictor of boxes: network, the scale that was calibrated, and certificate in one object and one file."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, reduce
from itertools import product
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Rule, rule_of, scale_of
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.boxes.boxes import TUBE, between
from coverdrive.prediction.boxes.network import BoxNetwork
from coverdrive.prediction.boxes.under_way import lane_changes
from coverdrive.prediction.stored import StoredPredictor, features_of
from coverdrive.road import Road
from coverdrive.scene import Scene, beside

_ENDS = np.array(list(product((-0.8, 0.0, 0.8), repeat=2)))
"""where motions that traffic may drive end, in half sizes of the last box: a turned body still has room in it"""


@dataclass(frozen=True, eq=False)
class BoxPredictor(StoredPredictor):
    """Says in which box every vehicle of a scene stays."""

    network: BoxNetwork
    rule: Rule
    """thresholds, of one base"""
    calibrated: Certificate
    trained_on: Int[np.ndarray, " V"]
    step: float
    """[s] between two boxes that were learned"""
    rungs: Float[np.ndarray, "n 2"] = field(default_factory=lambda: np.zeros((0, 2)))
    scale: float = 1.0
    basis: ClassVar[None] = None
    tube: ClassVar[float] = TUBE

    @property
    def _grid(self) -> tuple[float, int]:
        return self.step, len(self.network.usual)

    def _paths(self, scene: Scene, road: Road, others: Bool[np.ndarray, " A"], dt: float, steps: int) -> PredictedPaths:
        """One path for each arm of each vehicle's boxes, and one for each lane change that is under way.

        The latter is there for those whom boxes of scale 1 do not hold, whatever the scale, but for that of 0.
        """
        vehicle, times = np.flatnonzero(others), dt * np.arange(steps + 1)
        centre, half_sizes = self._boxes_at(scene, road, vehicle, times)
        lon, lat, speed, heading, length, width = (np.asarray(each)[vehicle, None] for each in scene.measures)
        centre[..., 0] += lon + times * (speed * np.cos(heading))
        centre[..., 1] += lat
        body, arms = beside(length, width) / 2, np.asarray(self.network.arms)
        paths = [PredictedPaths(centre, vehicle, self.scale * arm * half_sizes + body, dt) for arm in arms]
        if self.scale > 0:
            calibrated = PredictedPaths(centre, vehicle, arms[-1] * half_sizes + body, dt)
            changes = lane_changes(calibrated, scene)
            paths += [changes] if len(changes) else []
        return reduce(PredictedPaths.joined, paths)

    def choices(
        self, scene: Scene, road: Road, times: Float[np.ndarray, " n"]
    ) -> tuple[Float[np.ndarray, "A M n 2"], Float[np.ndarray, "A M n 2"], Bool[np.ndarray, "A M"]]:
        """M = 9 motions within the boxes of every slot, as deviations [m] from constant velocity, and their rates.

        The boxes are those of scale 1: what vehicles do does not depend on how bold the ego is. Motions leave the
        centres of the boxes with the square of time along the road, smoothly and for good across it.
        """
        centre, half_sizes = self._boxes_at(scene, road, np.arange(scene.vehicles), times)
        share = times[:, None] / times[-1]
        way = np.concatenate([share**2, share**2 * (3 - 2 * share)], axis=1)
        reach = (half_sizes[:, 1:] / way[1:]).min(1, keepdims=True)
        aslant = (_ENDS != 0).all(1, keepdims=True)
        ends = np.where(aslant, np.asarray(self.network.arms).min(0), 1) * _ENDS
        deviation = centre[:, None] + ends[:, None] * (reach * way)[:, None]
        possible = np.broadcast_to(np.asarray(scene.valid)[:, None], deviation.shape[:2]).copy()
        return deviation, np.gradient(deviation, times, axis=-2), possible

    def _boxes_at(
        self, scene: Scene, road: Road, vehicle: Int[np.ndarray, " n"], times: Float[np.ndarray, " K"]
    ) -> tuple[Float[np.ndarray, "n K 2"], Float[np.ndarray, "n K 2"]]:
        """Centres and half sizes of the calibrated boxes of some slots at ``times`` [s]."""
        values = self._values(features_of(scene, road, vehicle)[: len(vehicle)])
        place, size, early = between(len(self.network.usual), self.step, tuple(times.tolist()))
        at_first = np.asarray(self.network.early) * values[1, :, :1]
        return place @ values[0], scale_of(self.rule) * (size @ values[1] + early[:, None] * at_first)

    @cached_property
    def _values(self) -> Callable[[Float32[np.ndarray, "n F"]], Float[np.ndarray, "2 n P 2"]]:
        """The function of features that gives centres and half sizes."""
        return self.network.function

    @property
    def _header(self) -> dict[str, Any]:
        return super()._header | {"boxes": {"step": self.step, "scale": self.scale}}

    @staticmethod
    def of(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> "BoxPredictor":
        """The predictor that was stored like this."""
        network = BoxNetwork.of(arrays, header["network"])
        rule, certificate = rule_of(header["rule"], arrays), Certificate(**header["certificate"])
        return BoxPredictor(network, rule, certificate, arrays["trained_on"], rungs=arrays["rungs"], **header["boxes"])
