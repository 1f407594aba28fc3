"""The trajectory basis: M base trajectories that represent all others up to ε (paper §2.1, Fig. 1).

The distance of two segments is the atomic norm of their difference whose unit ball is an ellipse at every sample,
growing with time: max over t of ‖(Δlon·s_t/4, Δlat·s_t)‖₂ with s_t = (T−1)/(T−1+t). With ε = 0.5 the tolerance is
2 m × 0.5 m at the start and 4 m × 1 m at the end of the horizon.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from pydantic import Field, PositiveFloat, PositiveInt
from scipy.interpolate import CubicSpline

from coverdrive.errors import DataError
from coverdrive.prediction.cover import greedy_cover, with_mirror_images
from coverdrive.prediction.free_centres import free_centres
from coverdrive.prediction.segments import Segments
from coverdrive.prediction.storage import load_arrays, save_arrays
from coverdrive.settings import Settings

Centres = Literal["segments", "free"]
"""Where base trajectories are taken from"""

_CHUNK = 65_536


class BasisSettings(Settings):
    """Size of the tolerance, and how the cover is searched."""

    epsilon: PositiveFloat = 0.75
    """radius ε of the cover: the tolerance across the road at the start [m]. The authors' scripts have 0.5, and reach
    17 bases by dropping rare ones; covering every segment, 0.75 gives about as many"""
    aspect: PositiveFloat = 4.0
    """tolerance along the road over tolerance across it (authors' scripts)"""
    growth: float = Field(default=1.0, ge=0)
    """relative growth of the tolerance over the horizon (authors' scripts: it doubles)"""
    candidates: PositiveInt = 4096
    """segments that greedy choice picks from at a time; more can give a smaller basis and takes longer"""
    symmetric: bool = False
    """with every base trajectory, its mirror image (left for right) is in the basis"""
    centres: Centres = "segments"
    """whether base trajectories are segments, as in the paper, or any trajectories, of which fewer are enough"""


class Basis(eqx.Module):
    """M base trajectories of T points, as deviations from constant velocity."""

    points: Float[np.ndarray, "M T 2"]
    """[m] deviation along lon and lat; the first point is zero"""
    epsilon: float
    """radius of the cover that the basis was made for"""
    aspect: float
    """tolerance along the road over tolerance across it"""
    growth: float
    """relative growth of the tolerance over the horizon"""
    step: float
    """[s] between two points"""

    def __len__(self) -> int:
        """Number of base trajectories M."""
        return self.points.shape[0]

    @property
    def horizon(self) -> float:
        """[s] from the first to the last point."""
        return self.step * (self.points.shape[1] - 1)

    @property
    def tolerances(self) -> dict[str, float]:
        """Everything but the points, by name."""
        return {name: float(getattr(self, name)) for name in ("epsilon", "aspect", "growth", "step")}

    def distance(self, points: Float[np.ndarray, "N T 2"]) -> Float[np.ndarray, "N M"]:
        """Atomic norm of the difference of every segment to every base trajectory."""
        bases = self.scaled(self.points)
        chunks = (self.scaled(points[i : i + _CHUNK]) for i in range(0, len(points), _CHUNK))
        return np.concatenate([np.zeros((0, len(self))), *(_distance(chunk, bases) for chunk in chunks)])

    def tolerance(self, radius: float, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Half axes [m] along lon and lat of the ellipse of radius ``radius`` at ``times`` [s] in the horizon."""
        across = radius * (1 + self.growth * times / self.horizon)
        return np.stack([self.aspect * across, across], axis=-1)

    def rollout(self, times: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, "M n 2"], Float[np.ndarray, "M n 2"]]:
        """Deviation [m] of every base trajectory at any ``times`` [s] in the horizon, and its rate [m/s].

        A cubic spline through the points. At the start the rate along the road is zero: the deviation is taken from
        the speed at that moment.
        """
        knots = self.step * np.arange(self.points.shape[1])
        still = np.zeros(len(self))
        ends = ((1, still), (2, still))
        lon = CubicSpline(knots, self.points[..., 0], axis=1, bc_type=ends)  # pyright: ignore[reportArgumentType]
        lat = CubicSpline(knots, self.points[..., 1], axis=1, bc_type="natural")
        deviation = np.stack([lon(times), lat(times)], axis=-1)
        rate = np.stack([lon(times, 1), lat(times, 1)], axis=-1)
        return deviation, rate

    def scaled(self, points: Float[np.ndarray, "*batch T 2"]) -> Float[np.ndarray, "*batch T 2"]:
        """Segments in coordinates in which the atomic norm is the maximum over t of the Euclidean length."""
        return points / self.tolerance(1.0, self.step * np.arange(self.points.shape[1]))

    def save(self, path: Path, source: str = "") -> None:
        """Write the basis to a file.

        Args:
            path: of the file.
            source: fingerprint of the segments that it was made from.
        """
        save_arrays(path, "basis", {**self.tolerances, "source": source}, {"points": self.points})

    @staticmethod
    def load(path: Path) -> "Basis":
        """Read a basis.

        Raises:
            DataError: the file is missing, or not one that `save` wrote.
        """
        header, arrays = load_arrays(path, "basis", "coverdrive basis")
        del header["source"]
        return Basis(arrays["points"], **header)


@jax.jit
def _distance(segments: Float[Array, "N T 2"], bases: Float[Array, "M T 2"]) -> Float[Array, "N M"]:
    squared = [((segments[:, None, t] - bases[None, :, t]) ** 2).sum(-1) for t in range(bases.shape[1])]
    return jnp.sqrt(jnp.stack(squared).max(0))


def make_basis(
    segments: Segments,
    settings: BasisSettings | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Basis:
    """Cover all segments with few of them.

    Args:
        segments: the segments to cover; the base trajectories are taken from them, and from their mirror
            images if the settings say symmetric, unless the settings leave their centres free.
        settings: tolerance and search.
        seed: of the search.
        progress: called with the share of segments covered so far.

    Raises:
        DataError: there is no segment, or a point is not finite.
    """
    settings = settings or BasisSettings()
    if len(segments) == 0 or not np.isfinite(segments.points).all():
        raise DataError(f"a basis needs segments of finite points, got {len(segments)} segments")
    tolerance = {"epsilon": settings.epsilon, "aspect": settings.aspect, "growth": settings.growth}
    everything = Basis(segments.points, step=segments.step, **tolerance)
    scaled = everything.scaled(segments.points)
    chosen = greedy_cover(scaled, settings.epsilon, settings.candidates, seed, progress, settings.symmetric)
    points = segments.points[chosen]
    if settings.centres == "free":
        centres = free_centres(scaled, scaled[chosen], settings.epsilon, seed, settings.symmetric)
        points = centres * everything.tolerance(1.0, segments.step * np.arange(points.shape[1]))
    if settings.symmetric:
        points = with_mirror_images(points)
    basis = Basis(points, step=segments.step, **tolerance)
    uncovered = int((basis.distance(segments.points).min(1) > settings.epsilon).sum())
    if uncovered:
        raise DataError(f"the basis leaves {uncovered} of {len(segments)} segments uncovered; please report this")
    return basis
