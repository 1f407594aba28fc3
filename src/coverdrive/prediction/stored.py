"""What predictors have in common: the times that are asked for, for whom, and one file that holds everything."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import jax
import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from coverdrive.arguments import of_kind, path_of, shown
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Rule
from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.learning.affordance import FEATURES, MOTION, described_at
from coverdrive.prediction.storage import fingerprint_of, save_arrays
from coverdrive.road import Road
from coverdrive.scene import Scene

jax.config.update("jax_cpu_enable_async_dispatch", False)  # a few vehicles are not worth another thread

P = TypeVar("P", bound="StoredPredictor")

LARGEST = 100.0
"""scale λ beyond which sets would say nothing"""

ALONE = {"xla_cpu_multi_thread_eigen": False, "xla_cpu_enable_concurrency_optimized_scheduler": False}
"""to XLA: neither are they worth it that layers wait for other threads"""

SLOTS = 8
"""Features are padded to a multiple of so many vehicles, so that little is compiled"""

_ROUNDING = 1e-9
"""[s] by which a horizon may be longer than that of the predictor, for rounding"""


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


class StoredPredictor(ABC):
    """What all predictors have in common: sets of any scale on any grid of times within a horizon, and one file.

    All sets of one are nested in its scale λ: at 0 there is the likeliest path alone, at 1 what was calibrated.
    """

    network: Any
    rule: Rule
    calibrated: Certificate
    """of the sets of scale 1"""
    trained_on: Int[np.ndarray, " V"]
    """keys of the vehicles that trained the network"""
    rungs: Float[np.ndarray, "n 2"]
    """bounds ε, and the scale from which on each is proved; all at once with the confidence of the certificate"""
    scale: float
    """λ: the sets are so many times as large as they were calibrated"""

    @cached_property
    @abstractmethod
    def _values(self) -> Callable[[Any], Any]: ...

    @property
    @abstractmethod
    def _grid(self) -> tuple[float, int]:
        """[s] between two points that were learned, and how many there are after now."""

    @abstractmethod
    def _paths(
        self, scene: Scene, road: Road, others: Bool[np.ndarray, " A"], dt: float, steps: int
    ) -> PredictedPaths: ...

    @property
    def _arrays(self) -> dict[str, np.ndarray]:
        return {"trained_on": self.trained_on, "rungs": self.rungs, **self.rule.arrays, **self.network.arrays}

    @property
    def _header(self) -> dict[str, Any]:
        return {"network": self.network.kind, "rule": self.rule.kind, "certificate": asdict(self.calibrated)}

    @property
    def horizon(self) -> float:
        """[s] that it looks ahead."""
        step, count = self._grid
        return step * count

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

        Args:
            scene: one scene.
            road: its road.
            ego: slot of the vehicle that asks; no paths are predicted for it. None: all vehicles are predicted.
            dt: [s] between two points of the paths; that of what was learned if not given.
            steps: K; the paths have K + 1 points. If not given, they reach to the end of the horizon.
            like: has the ``dt`` and ``steps`` to take, as a planner does.

        Raises:
            SettingError: ``ego`` is not the slot of a vehicle, the scene is not of one moment, the road none, or the
                paths would not end within the horizon.
        """
        period, count = grid_of(self.horizon, self._grid[0], dt, steps, like)
        of_kind("road", road, Road, "a Road")
        return self._paths(scene, road, others_of(scene, ego), period, count)

    def scaled(self: P, scale: float) -> P:
        """The same with sets of another scale λ; `SettingError` unless it is between 0 and 100.

        What is compiled does not depend on the scale, and is shared.
        """
        scaled = replace(self, scale=checked_scale(scale))  # pyright: ignore[reportArgumentType]
        scaled.__dict__["_values"] = self._values
        return scaled

    @property
    def certificate(self) -> Certificate:
        """Of the sets as they are: from scale 1 on what was calibrated, below it the smallest bound that is proved."""
        epsilon = self.calibrated.epsilon
        if self.scale < 1:
            epsilon = min((bound for bound, least in self.rungs.tolist() if least <= self.scale), default=1.0)
        return replace(self.calibrated, epsilon=epsilon, scale=self.scale)

    @cached_property
    def fingerprint(self) -> str:
        """A short hash of everything that is stored of it, the certificate included."""
        return fingerprint_of(self._header, self._arrays)

    def save(self, path: Path | str) -> None:
        """Write it to a file, or to none if interrupted; `SettingError` if it cannot be stored."""
        save_arrays(path_of("path", path), "predictor", self._header, self._arrays)

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone; what is cached belongs to the process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}  # pyright: ignore[reportArgumentType]


def checked_scale(scale: float) -> float:
    """A scale λ of sets that makes sense; else a `SettingError`."""
    if not (isinstance(scale, Real) and 0 <= scale <= LARGEST):
        raise SettingError(
            f"sets are scaled by a number between 0, the likeliest path alone, and {LARGEST:g}, got {shown(scale)}; "
            "1 are those that were calibrated"
        )
    return float(scale)


def grid_of(
    horizon: float, step: float, dt: float | None = None, steps: int | None = None, like: TimeGrid | None = None
) -> tuple[float, int]:
    """The grid of times that is asked for, if the horizon reaches that far; ``step`` apart if nothing is."""
    if like is not None and not dt is steps is None:
        raise SettingError("a planner that is to be like has its dt and steps; leave these out")
    if like is not None:
        dt, steps = of_kind("like", like, TimeGrid, "a planner, which has dt and steps").dt, like.steps
    dt = step if dt is None else dt
    if not (isinstance(dt, Real) and 0 < dt < np.inf):
        raise SettingError(f"the time dt between two points of a path must be positive, got {shown(dt)} s; try 0.25")
    steps = int(horizon / dt + _ROUNDING) if steps is None else steps
    if not (isinstance(steps, Real) and 1 <= steps < 1e9 and steps == int(steps)):
        tried = f"got {shown(steps)}; try {horizon / dt:.0f}"
        raise SettingError(f"a path has a whole number of steps, at least one, {tried}")
    if dt * steps > horizon + _ROUNDING:
        raise SettingError(
            f"{steps} steps of {dt:g} s are {dt * steps:g} s, but this predictor knows what vehicles do within "
            f"{horizon:g} s; take at most {int(horizon / dt + _ROUNDING)} steps, or fit one with a longer horizon"
        )
    return float(dt), int(steps)


def features_of(scene: Scene, road: Road, vehicle: Int[np.ndarray, " n"]) -> Float32[np.ndarray, "padded F"]:
    """The features of some slots of a scene, followed by rows of zeros; at least one row."""
    features = np.zeros((SLOTS * max(1, -(-len(vehicle) // SLOTS)), len(FEATURES) + len(MOTION)), dtype=np.float32)
    if len(vehicle):
        one = Scene(*(np.asarray(values)[None] for values in vars(scene).values()))
        features[: len(vehicle)] = described_at(one, road.edges_at(one.lon), np.zeros_like(vehicle), vehicle)
    return features


def others_of(scene: Scene, ego: int | None) -> Bool[np.ndarray, " A"]:
    """The slots of vehicles but the ego's; `SettingError` if ``ego`` is not the slot of a vehicle."""
    shapes = {np.shape(values) for values in vars(of_kind("scene", scene, Scene, "a Scene")).values()}
    if len(shapes) > 1 or len(min(shapes)) != 1:
        raise SettingError(f"scene: expected one moment, fields of one shape (A,), got {sorted(shapes)}")
    others = np.array(scene.valid)
    known = isinstance(ego, int | np.integer) and not isinstance(ego, bool)
    if ego is not None and not (known and 0 <= ego < len(others) and others[ego]):
        slots = ", ".join(map(str, np.flatnonzero(others)[:8])) or "none"
        raise SettingError(
            f"ego = {shown(ego)} is not the slot of a vehicle of this scene, which has {int(others.sum())} of them "
            f"(slots {slots}{', …' if others.sum() > 8 else ''}); give one of these slots, or None to predict everybody"
        )
    if ego is not None:
        others[ego] = False
    return others
