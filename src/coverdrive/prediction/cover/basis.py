"""The trajectory basis: M base trajectories that represent all others up to ε (paper §2.1, Fig. 1).

The distance of two segments is the atomic norm of their difference whose unit ball is an ellipse at every sample,
growing with time: max over t of ‖(Δlon·s_t/4, Δlat·s_t)‖₂ with s_t = (T−1)/(T−1+t). With ε = 0.5 the tolerance is 2 m ×
0.5 m at the start and 4 m × 1 m at the end of the horizon. Afterwards the unit ball is cut at every sample to what the
segments need that a base covers: a narrower tube, which covers the same segments.
"""

from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float
from pydantic import Field
from scipy.interpolate import CubicSpline

from coverdrive.errors import DataError
from coverdrive.prediction.cover.greedy import CAUTION, greedy_cover
from coverdrive.prediction.data.parts import parts
from coverdrive.prediction.data.segments import MIRROR, Segments
from coverdrive.prediction.storage import loaded, save_arrays
from coverdrive.settings import Settings

_LEAST_REACH = 0.05
"""share of the ellipse's half axes that the tube has at least, however alike the segments are"""


class BasisSettings(Settings):
    """Size of the tolerance, and how the cover is searched."""

    radius: float = Field(default=0.75, ge=0.01, le=1000)
    """radius ε of the cover: the tolerance across the road at the start [m]. The authors' scripts have 0.5, and reach
    17 bases by dropping rare ones; covering every segment, 0.75 gives about as many"""
    aspect: float = Field(default=4.0, ge=0.01, le=1000)
    """tolerance along the road over tolerance across it (authors' scripts)"""
    growth: float = Field(default=1.0, ge=0, le=1000)
    """relative growth of the tolerance over the horizon (authors' scripts: it doubles)"""
    candidates: int = Field(default=4096, ge=1, le=10_000_000)
    """segments that greedy choice picks from at a time; more can give a smaller basis and takes longer"""
    cut: bool = True
    """whether the tube is cut, at every point, to what the segments need that a base covers; the paper's is not"""


class Basis(eqx.Module):
    """M base trajectories of T points, as deviations from constant velocity; their tolerance as in `BasisSettings`."""

    points: Float[np.ndarray, "M T 2"]
    """[m] deviation along lon and lat; the first point is zero"""
    radius: float
    aspect: float
    growth: float
    step: float
    """[s] between two points"""
    reach: Float[np.ndarray, "T 2"] | None = None
    """[m] half extents along lon and lat within which a base covers, besides the ellipse; None: the ellipse alone"""

    def __len__(self) -> int:
        """Number of base trajectories M."""
        return self.points.shape[0]

    @property
    def times(self) -> Float[np.ndarray, " T"]:
        """[s] of the points."""
        return self.step * np.arange(self.points.shape[1])

    @property
    def horizon(self) -> float:
        """[s] from the first to the last point."""
        return self.step * (self.points.shape[1] - 1)

    @property
    def tolerances(self) -> dict[str, float]:
        """Everything but the points, by name."""
        return {name: float(getattr(self, name)) for name in ("radius", "aspect", "growth", "step")}

    @property
    def cut(self) -> dict[str, np.ndarray]:
        """The reach by its name, where there is one."""
        return {} if self.reach is None else {"reach": self.reach}

    def distance(self, points: Float[np.ndarray, "N T 2"]) -> Float[np.ndarray, "N M"]:
        """Atomic norm of the difference of every segment to every base trajectory: a base covers what is within ε."""
        bases, tube = self.scaled(self.points), self._knots / self._axes
        result = np.empty((len(points), len(self)))
        for part in parts(len(points)):
            result[part] = _distance(self.scaled(points[part]), bases, tube)
        return result

    def tube(self, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Half extents [m] along lon and lat of the tube of radius 1 at ``times`` [s] in the horizon.

        Linear between the points of the segments, from 0: all paths start at the same point.
        """
        return np.stack([np.interp(times, self.times, column) for column in self._knots.T], axis=-1)

    @property
    def _knots(self) -> Float[np.ndarray, "T 2"]:
        """The tube of radius 1 at the points of the segments."""
        widest = self._axes if self.reach is None else np.minimum(self._axes, self.reach / self.radius)
        return np.concatenate([np.zeros((1, 2)), widest[1:]])

    @property
    def _axes(self) -> Float[np.ndarray, "T 2"]:
        return self.tolerance(1.0, self.times)

    def tolerance(self, radius: float, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Half axes [m] along lon and lat of the ellipse of radius ``radius`` at ``times`` [s] in the horizon."""
        across = radius * (1 + self.growth * times / self.horizon)
        return np.stack([self.aspect * across, across], axis=-1)

    def rollout(self, times: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, "M n 2"], Float[np.ndarray, "M n 2"]]:
        """Deviation [m] of every base trajectory at ``times`` [s] in the horizon, and its rate [m/s], by cubic splines.

        At the start the rate along the road is zero: the deviation is taken from the speed at that moment.
        """
        still = np.zeros(len(self))
        ends = ((1, still), (2, still))
        lon = CubicSpline(self.times, self.points[..., 0], axis=1, bc_type=ends)  # pyright: ignore[reportArgumentType]
        lat = CubicSpline(self.times, self.points[..., 1], axis=1, bc_type="natural")
        deviation = np.stack([lon(times), lat(times)], axis=-1)
        rate = np.stack([lon(times, 1), lat(times, 1)], axis=-1)
        return deviation, rate

    def scaled(self, points: Float[np.ndarray, "*batch T 2"]) -> Float[np.ndarray, "*batch T 2"]:
        """Segments in coordinates in which the atomic norm is the maximum over t of the Euclidean length."""
        return points / self._axes

    def save(self, path: Path, source: str = "") -> None:
        """Write it to a file, with the fingerprint of the segments that it was made from."""
        save_arrays(path, "basis", self.tolerances | {"source": source}, {"points": self.points} | self.cut)

    @staticmethod
    def load(path: Path) -> "Basis":
        """Read what `save` wrote; else raise `DataError`."""
        with loaded(path, "basis", "coverdrive basis") as (header, arrays):
            del header["source"]
            return Basis(**arrays, **header)


@jax.jit
def _distance(
    segments: Float[Array, "N T 2"], bases: Float[Array, "M T 2"], tube: Float[Array, "T 2"]
) -> Float[Array, "N M"]:
    """The norm of which the unit ball is, at every point but the first, the unit circle cut to a box."""
    furthest = jnp.zeros((segments.shape[0], bases.shape[0]))
    for t in range(1, bases.shape[1]):
        apart = jnp.abs(segments[:, None, t] - bases[None, :, t])
        furthest = jnp.maximum(furthest, jnp.hypot(apart[..., 0], apart[..., 1]))
        furthest = jnp.maximum(furthest, (apart / tube[t]).max(-1))
    return furthest


def make_basis(segments: Segments, settings: BasisSettings | None = None, seed: int = 0) -> Basis:
    """Cover all segments with few of them.

    Raises:
        DataError: there is no segment, or a point is not finite.
    """
    settings = settings or BasisSettings()
    if len(segments) == 0 or not np.isfinite(segments.points).all():
        raise DataError(f"a basis needs segments of finite points, got {len(segments)} segments")
    everything = Basis(segments.points, settings.radius, settings.aspect, settings.growth, segments.step)
    scaled = everything.scaled(segments.points)
    chosen = greedy_cover(scaled, settings.radius, settings.candidates, seed)
    basis = replace(everything, points=segments.points[chosen])
    if settings.cut:
        basis = replace(basis, reach=_reach_of(basis, segments.points))
    uncovered = int((basis.distance(segments.points).min(1) > settings.radius).sum())
    if uncovered:
        raise DataError(f"the basis leaves {uncovered} of {len(segments)} segments uncovered; please report this")
    return basis


def _reach_of(basis: Basis, points: Float[np.ndarray, "N T 2"]) -> Float[np.ndarray, "T 2"]:
    """[m] how far segments, and their mirror images, are from the bases that cover them, at the most."""
    furthest = np.zeros(basis.points.shape[1:])
    for side in (points, points * MIRROR):
        for part in parts(len(side)):
            covered = basis.distance(side[part]) <= basis.radius
            furthest = np.maximum(furthest, _furthest(side[part], basis.points, covered))
    return np.maximum(furthest * (1 + CAUTION), _LEAST_REACH * basis.tolerance(basis.radius, basis.times))


@jax.jit
def _furthest(
    segments: Float[Array, "N T 2"], bases: Float[Array, "M T 2"], covered: Bool[Array, "N M"]
) -> Float[Array, "T 2"]:
    apart = (jnp.abs(segments[:, None, t] - bases[None, :, t]) for t in range(bases.shape[1]))
    return jnp.stack([jnp.where(covered[..., None], each, 0.0).max((0, 1)) for each in apart])
