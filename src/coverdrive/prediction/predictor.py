"""The predictor: basis, network, rule and certificate in one object and one file.

Nothing in the file can be executed (`coverdrive.prediction.storage`).
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Rule, rule_of
from coverdrive.errors import DataError, SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.learning.affordance import described
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.own_network import OwnNetwork
from coverdrive.prediction.motion import add_bodies, follow
from coverdrive.prediction.storage import fingerprint_of, load_arrays, reading, save_arrays
from coverdrive.road import Road
from coverdrive.scene import Scene

_SLOTS = 8
_COMMAND = "coverdrive fit"
_Asked = tuple[float | None, int | None]
_ROUNDING = 1e-9
"""[s] by which a horizon may be longer than that of the basis, for rounding"""


@runtime_checkable
class TimeGrid(Protocol):
    """Anything that looks ahead in steps, as a planner does."""

    @property
    def dt(self) -> float:
        """[s] of a step."""
        ...

    @property
    def steps(self) -> int:
        """Number of steps."""
        ...


@dataclass(frozen=True)
class Predictor:
    """Says what every vehicle of a scene may do next."""

    basis: Basis
    network: Network | OwnNetwork
    rule: Rule
    certificate: Certificate
    trained_on: Int[np.ndarray, " V"]
    """keys of the vehicles that trained the network"""
    _rollouts: dict[_Asked, tuple[np.ndarray, ...]] = field(
        default_factory=dict[_Asked, tuple[np.ndarray, ...]], init=False, repr=False, compare=False
    )

    @cached_property
    def fingerprint(self) -> str:
        """A short hash of everything that is stored of it, the certificate included."""
        return fingerprint_of(self._header, self._arrays)

    def possible(self, scene: Scene, road: Road) -> Bool[np.ndarray, "A M"]:
        """The bases that the rule calls possible for every slot of one scene; none for slots without a vehicle."""
        return self._scored(scene, road)[0]

    def _scored(self, scene: Scene, road: Road) -> tuple[Bool[np.ndarray, "A M"], Float[np.ndarray, "A M"]]:
        """`possible`, and the scores."""
        values = np.asarray(self._values(scene.packed(_SLOTS), road.edges))[: scene.vehicles]
        scores, hidden = values[:, : len(self.rule.tube)], values[:, len(self.rule.tube) :]
        return self.rule.possible(scores, hidden) & np.asarray(scene.valid)[:, None], scores

    def predict(
        self,
        scene: Scene,
        road: Road,
        ego: int | None = None,
        dt: float | None = None,
        steps: int | None = None,
        *,
        like: TimeGrid | None = None,
    ) -> PredictedPaths:
        """All paths that the vehicles of a scene may take.

        A vehicle for which the rule calls nothing possible may do anything that the basis knows.

        Args:
            scene: one scene.
            road: its road.
            ego: slot of the vehicle that asks; no paths are predicted for it. None: all vehicles are predicted.
            dt: [s] between two points of the paths; that of the basis if not given.
            steps: K; the paths have K + 1 points. If not given, they reach to the end of the basis' horizon.
            like: has the ``dt`` and ``steps`` to take, as a planner does.

        Raises:
            SettingError: ``ego`` is not the slot of a vehicle, or the paths would not end within the basis' horizon.
        """
        if like is not None:
            dt, steps = like.dt, like.steps
        times, deviation, rate, tube, ellipses = self._rollout(dt, steps)
        valid = np.asarray(scene.valid)
        if ego is not None and not (0 <= ego < len(valid) and valid[ego]):
            slots = ", ".join(map(str, np.flatnonzero(valid)[:8])) or "none"
            raise SettingError(
                f"ego = {ego} is not the slot of a vehicle of this scene, which has {int(valid.sum())} of them (slots "
                f"{slots}{', …' if valid.sum() > 8 else ''}); give one of these slots, or None to predict everybody"
            )
        possible, scores = self._scored(scene, road)
        possible[valid & ~possible.any(axis=1)] = True
        if ego is not None:
            possible[ego] = False
        vehicle, base = np.nonzero(possible)
        motion = follow(scene.states[vehicle], times, deviation[base], rate[base])
        half_sizes = tube[base]
        add_bodies(half_sizes, scene.half_sizes[vehicle], motion)
        weight = scores[vehicle, base].astype(float)
        return PredictedPaths(motion[..., :2], vehicle, half_sizes, float(times[1]), ellipses[base], weight)

    @cached_property
    def _values(self) -> Callable[[Float[np.ndarray, "7 A"], Float[Array | np.ndarray, " E"]], Array | np.ndarray]:
        """The function of a packed scene and road edges that gives M scores and then the last hidden layer.

        One compiled function with one result: XLA takes about as long for every array handed over as for a layer.
        """
        network = self.network

        def features(rows: Float[Array, "7 A"], edges: Float[Array, " E"]) -> Float[Array, "A F"]:
            return described(Scene.unpacked(rows), Road(edges, np.inf))

        if isinstance(network, OwnNetwork):
            compiled = jax.jit(features)
            return lambda rows, edges: network.scores(np.asarray(compiled(rows, edges)))

        def values(rows: Float[Array, "7 A"], edges: Float[Array, " E"]) -> Float[Array, "A _"]:
            seen = features(rows, edges)
            return jnp.concatenate([network.scores(seen), network.hidden(seen)], axis=-1)

        return jax.jit(values)

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone; what is cached belongs to the process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def _rollout(self, dt: float | None, steps: int | None) -> tuple[np.ndarray, ...]:
        """Times, deviations and their rates, tubes and their ellipses at these times; kept for the next call."""
        kept = self._rollouts.get((dt, steps))
        if kept is None:
            period, count = self._grid(dt, steps)
            times = period * np.arange(count + 1)
            tubes = (self.basis.tube(times), self.basis.tolerance(1.0, times))
            tube, ellipses = (self.rule.tube[:, None, None] * each for each in tubes)
            kept = self._rollouts[dt, steps] = (times, *self.basis.rollout(times), tube, ellipses)
        return kept

    def _grid(self, dt: float | None, steps: int | None) -> tuple[float, int]:
        """The grid that is asked for, if the basis reaches that far."""
        horizon = self.basis.horizon
        dt = self.basis.step if dt is None else dt
        if not 0 < dt < np.inf:
            raise SettingError(f"the time dt between two points of a path must be positive, got {dt} s; try 0.25")
        steps = int(horizon / dt + _ROUNDING) if steps is None else steps
        if steps < 1 or steps != int(steps):
            raise SettingError(f"a path has a whole number of steps, at least one, got {steps}; try {horizon / dt:.0f}")
        if dt * steps > horizon + _ROUNDING:
            raise SettingError(
                f"{steps} steps of {dt:g} s are {dt * steps:g} s, but this predictor knows what vehicles do within "
                f"{horizon:g} s; take at most {int(horizon / dt + _ROUNDING)} steps, or fit one with a longer horizon"
            )
        return dt, int(steps)

    @property
    def _arrays(self) -> dict[str, np.ndarray]:
        return {
            "basis": self.basis.points,
            **self.basis.cut,
            "trained_on": self.trained_on,
            **self.rule.arrays,
            **self.network.arrays,
        }

    @property
    def _header(self) -> dict[str, Any]:
        return {
            "basis": self.basis.tolerances,
            "network": self.network.kind,
            "rule": self.rule.kind,
            "certificate": asdict(self.certificate),
        }

    def save(self, path: Path) -> None:
        """Write it to a file, or to none if interrupted; `SettingError` if the scores come from a function."""
        if isinstance(self.network, OwnNetwork):
            raise SettingError(
                f"the scores of this predictor come from {self.network.function!r}, and no file can hold a function; "
                "keep your network in a file of its own, and certify it again where it is needed"
            )
        save_arrays(path, "predictor", self._header, self._arrays)

    @staticmethod
    def load(path: Path) -> "Predictor":
        """Read what `save` wrote; else raise `DataError`."""
        header, arrays = load_arrays(path, "predictor", _COMMAND)
        with reading(path, "predictor", _COMMAND):
            predictor = Predictor(
                basis=Basis(arrays["basis"], reach=arrays.get("reach"), **header["basis"]),
                network=Network.of(arrays, header["network"]),
                rule=rule_of(header["rule"], arrays),
                certificate=Certificate(**header["certificate"]),
                trained_on=arrays["trained_on"],
            )
            if predictor.fingerprint != fingerprint_of(header, arrays):
                raise DataError("it holds what no predictor has")
        return predictor
