"""The predictor: basis, network, rule and certificate in one object and one file."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Float32, Int

from coverdrive.arguments import path_of
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Rule, Thresholds, rule_of
from coverdrive.errors import DataError, SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.motion import add_bodies, follow
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.own_network import OwnNetwork
from coverdrive.prediction.storage import fingerprint_of, loaded
from coverdrive.prediction.stored import ALONE, StoredPredictor, features_of
from coverdrive.road import Road
from coverdrive.scene import Scene

_LEAST = 1e-9
"""least of what a score may lack"""


@dataclass(frozen=True, eq=False)
class Predictor(StoredPredictor):
    """Says what every vehicle of a scene may do next."""

    basis: Basis
    network: Network | OwnNetwork
    rule: Rule
    calibrated: Certificate
    trained_on: Int[np.ndarray, " V"]
    rungs: Float[np.ndarray, "n 2"] = field(default_factory=lambda: np.zeros((0, 2)))
    scale: float = 1.0

    @property
    def _grid(self) -> tuple[float, int]:
        return self.basis.step, self.basis.points.shape[1] - 1

    @property
    def tube(self) -> float:
        """Radius of the cover, beyond which a vehicle is outside every set."""
        return self.basis.radius

    def possible(self, scene: Scene, road: Road) -> Bool[np.ndarray, "A M"]:
        """The bases that the rule calls possible for every slot of one scene; none for slots without a vehicle."""
        return self._scored(scene, road)[0] & np.asarray(scene.valid)[:, None]

    def _scored(self, scene: Scene, road: Road) -> tuple[Bool[np.ndarray, "A M"], Float[np.ndarray, "A M"]]:
        """What the rule calls possible for every slot, and the scores."""
        values = np.asarray(self._values(features_of(scene, road, np.arange(scene.vehicles))))[: scene.vehicles]
        scores, hidden = values[:, : len(self.rule.tube)], values[:, len(self.rule.tube) :]
        return self.rule.possible(scores, hidden), scores

    def _within_scale(
        self, possible: Bool[np.ndarray, "A M"], scores: Float[np.ndarray, "A M"]
    ) -> Bool[np.ndarray, "A M"]:
        """The bases of the sets of this scale λ, given those of scale 1; everything where that is none.

        Base j needs the λ = (1 − score) / (1 − c_j); the one that needs least is always there.
        """
        everything = possible | ~possible.any(axis=1, keepdims=True)
        if self.scale == 1:
            return everything
        if not isinstance(self.rule, Thresholds):
            raise SettingError(
                f"sets of {self.rule.kind} have no scale but 1, got {self.scale:g}; calibrate by thresholds"
            )
        needed = (1 - scores) / np.maximum(1 - self.rule.values, _LEAST)
        within = (needed <= self.scale) | (needed == needed.min(axis=1, keepdims=True))
        return within | everything if self.scale > 1 else within & everything

    def _paths(self, scene: Scene, road: Road, others: Bool[np.ndarray, " A"], dt: float, steps: int) -> PredictedPaths:
        """One path for each base in the set of a vehicle, which is all that there are where none is possible."""
        times, deviation, rate, tube, ellipses = self._rollout(dt, steps)
        possible, scores = self._scored(scene, road)
        vehicle, base = np.nonzero(self._within_scale(possible, scores) & others[:, None])
        motion = follow(scene.states[vehicle], times, deviation[base], rate[base])
        half_sizes = tube[base]
        add_bodies(half_sizes, scene.half_sizes[vehicle], motion)
        weight = scores[vehicle, base].astype(float)
        return PredictedPaths(motion[..., :2], vehicle, half_sizes, float(times[1]), ellipses[base], weight)

    @cached_property
    def _values(self) -> Callable[[Float32[np.ndarray, "n F"]], Array | np.ndarray]:
        """The function of features that gives M scores and then the last hidden layer.

        One compiled function with one result: XLA takes about as long for every array handed over as for a layer.
        """
        network = self.network
        if isinstance(network, OwnNetwork):
            return network.scores

        def values(scaled: Float[Array, "n I"]) -> Float[Array, "n _"]:
            return jnp.concatenate(network.scored(scaled), axis=-1)

        scored, scaled = jax.jit(values, compiler_options=ALONE), network.scaled
        return lambda features: scored(scaled(features))

    def choices(
        self, scene: Scene, road: Road, times: Float[np.ndarray, " n"]
    ) -> tuple[Float[np.ndarray, "A M n 2"], Float[np.ndarray, "A M n 2"], Bool[np.ndarray, "A M"]]:
        """Every base for each slot, as deviation [m] from constant velocity, its rate, and whether it is possible."""
        possible = self.possible(scene, road)
        deviation, rate = (np.broadcast_to(each, (len(possible), *each.shape)) for each in self.basis.rollout(times))
        return deviation, rate, possible

    @cached_property
    def _rollout(self) -> Callable[[float, int], tuple[np.ndarray, ...]]:
        """The function of dt and steps that gives times, deviations, rates, tubes and ellipses, and keeps them."""

        @cache
        def rollout(dt: float, steps: int) -> tuple[np.ndarray, ...]:
            times = dt * np.arange(steps + 1)
            tubes = (self.basis.tube(times), self.basis.tolerance(1.0, times))
            scaled = (self.scale * self.rule.tube[:, None, None] * each for each in tubes)
            return (times, *self.basis.rollout(times), *scaled)

        return rollout

    @property
    def _arrays(self) -> dict[str, np.ndarray]:
        return super()._arrays | {"basis": self.basis.points} | self.basis.cut

    @property
    def _header(self) -> dict[str, Any]:
        return super()._header | {"basis": self.basis.tolerances, "scale": self.scale}

    def save(self, path: Path | str) -> None:
        """Write it to a file, or to none if interrupted; `SettingError` if the scores come from a function."""
        if isinstance(self.network, OwnNetwork):
            raise SettingError(
                f"the scores of this predictor come from {self.network.function!r}, and no file can hold a function; "
                "keep your network in a file of its own, and certify it again where it is needed"
            )
        super().save(path)

    @staticmethod
    def load(path: Path | str) -> "Predictor | BoxPredictor":
        """Read what `save` wrote; else raise `DataError`."""
        path = path_of("path", path)
        with loaded(path, "predictor", "coverdrive fit") as (header, arrays):
            predictor = (
                BoxPredictor.of(header, arrays)
                if "boxes" in header
                else Predictor(
                    basis=Basis(arrays["basis"], reach=arrays.get("reach"), **header["basis"]),
                    network=Network.of(arrays, header["network"]),
                    rule=rule_of(header["rule"], arrays),
                    calibrated=Certificate(**header["certificate"]),
                    trained_on=arrays["trained_on"],
                    rungs=arrays["rungs"],
                    scale=header["scale"],
                )
            )
            if predictor.fingerprint != fingerprint_of(header, arrays):
                raise DataError("it holds what no predictor has")
        return predictor


AnyPredictor = Predictor | BoxPredictor
"""What `fit` makes"""
