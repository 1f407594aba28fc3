"""The predictor: basis, network, rule and certificate in one object and one file.

Nothing in the file can be executed (`coverdrive.prediction.storage`).
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.certificates.certificate import Certificate, fingerprint
from coverdrive.certificates.rule import Rule, rule_of
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.affordance import described
from coverdrive.prediction.basis import Basis
from coverdrive.prediction.motion import add_bodies, follow
from coverdrive.prediction.network import Network
from coverdrive.prediction.storage import load_arrays, save_arrays
from coverdrive.road import Road
from coverdrive.scene import Scene

_SLOTS = 8


@dataclass(frozen=True)
class Predictor:
    """Says what every vehicle of a scene may do next."""

    basis: Basis
    network: Network
    rule: Rule
    certificate: Certificate
    trained_on: Int[np.ndarray, " V"]
    """keys of the vehicles that trained the network"""
    _rollouts: dict[tuple[float, int], tuple[np.ndarray, ...]] = field(
        default_factory=dict[tuple[float, int], tuple[np.ndarray, ...]], init=False, repr=False, compare=False
    )

    @property
    def fingerprint(self) -> str:
        """A short hash of everything that the verdicts depend on."""
        arrays = (*jax.tree.leaves((self.network, self.basis)), *self.rule.arrays.values())
        return fingerprint(*map(np.asarray, arrays))

    def possible(self, scene: Scene, road: Road) -> Bool[np.ndarray, "A M"]:
        """The bases that the rule calls possible for every slot of one scene; none for slots without a vehicle."""
        values = np.asarray(self._values(scene.packed(_SLOTS), road.edges))[: scene.vehicles]
        scores, hidden = values[:, : len(self.rule.tube)], values[:, len(self.rule.tube) :]
        return self.rule.possible(scores, hidden) & np.asarray(scene.valid)[:, None]

    def predict(self, scene: Scene, road: Road, own: int, dt: float, steps: int) -> PredictedPaths:
        """All paths that the other vehicles may take.

        A vehicle for which the rule calls nothing possible may do anything that the basis knows.

        Args:
            scene: one scene.
            road: its road.
            own: slot of the vehicle that asks; no paths are predicted for it.
            dt: [s] between two points of the paths; ``dt · steps`` must not exceed the basis' horizon.
            steps: K; the paths have K + 1 points.
        """
        possible = self.possible(scene, road)
        possible[np.asarray(scene.valid) & ~possible.any(axis=1)] = True
        possible[own] = False
        vehicle, base = np.nonzero(possible)
        times, deviation, rate, tube, ellipses = self._rollout(dt, steps)
        motion = follow(scene.states[vehicle], times, deviation[base], rate[base])
        half_sizes = tube[base]
        add_bodies(half_sizes, scene.half_sizes[vehicle], motion)
        return PredictedPaths(motion[..., :2], vehicle, half_sizes, dt, ellipses[base])

    @cached_property
    def _values(self) -> Callable[[Float[np.ndarray, "7 A"], Float[Array | np.ndarray, " E"]], Array]:
        """The function of a packed scene and road edges that gives M scores and then the last hidden layer.

        One compiled function that knows the network and gives one array: XLA takes about as long for every array that
        is handed over as for a layer.
        """

        def values(rows: Float[Array, "7 A"], edges: Float[Array, " E"]) -> Float[Array, "A _"]:
            features = described(Scene.unpacked(rows), Road(edges, np.inf))
            return jnp.concatenate([self.network.scores(features), self.network.hidden(features)], axis=-1)

        return jax.jit(values)

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone; what is cached belongs to the process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def _rollout(self, dt: float, steps: int) -> tuple[np.ndarray, ...]:
        """Times, deviations and their rates, tubes and their ellipses at these times; kept for the next call."""
        if (dt, steps) not in self._rollouts:
            times = dt * np.arange(steps + 1)
            tubes = (self.basis.tube(times), self.basis.tolerance(1.0, times))
            tube, ellipses = (self.rule.tube[:, None, None] * each for each in tubes)
            self._rollouts[dt, steps] = (times, *self.basis.rollout(times), tube, ellipses)
        return self._rollouts[dt, steps]

    def save(self, path: Path) -> None:
        """Write the predictor to a file; an interrupted write leaves no file behind."""
        arrays = {
            "basis": self.basis.points,
            **({} if self.basis.reach is None else {"reach": self.basis.reach}),
            "trained_on": self.trained_on,
            **self.rule.arrays,
            **self.network.arrays,
        }
        header = {
            "basis": self.basis.tolerances,
            "network": self.network.kind,
            "rule": self.rule.kind,
            "certificate": asdict(self.certificate),
        }
        save_arrays(path, "predictor", header, arrays)

    @staticmethod
    def load(path: Path) -> "Predictor":
        """Read a predictor.

        Raises:
            DataError: the file is missing, or not one that `save` wrote.
        """
        header, arrays = load_arrays(path, "predictor", "coverdrive fit")
        return Predictor(
            basis=Basis(arrays["basis"], reach=arrays.get("reach"), **header["basis"]),
            network=Network.of(arrays, header["network"]),
            rule=rule_of(header["rule"], arrays),
            certificate=Certificate(**header["certificate"]),
            trained_on=arrays["trained_on"],
        )
