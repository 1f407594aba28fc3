"""How large a basis has to be: bases of several ε for the same segments, verified, and bounds on the smallest."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
import polars as pl
from jaxtyping import Float

from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import SettingError
from coverdrive.prediction.cover.basis import Basis, BasisSettings, make_basis
from coverdrive.prediction.cover.lower_bounds import fractional_bound, packing
from coverdrive.prediction.data.segments import Segments
from coverdrive.progress import part


@dataclass(frozen=True)
class StudiedBasis:
    """A basis, how it covers the segments that it was made from, and how small any other could be."""

    basis: Basis
    share: Float[np.ndarray, " M"]
    """of the segments that is nearest to each base trajectory"""
    covered: float
    """share of the segments within ε of the basis, by distances in double precision"""
    largest: float
    """distance of the farthest segment to the basis"""
    anywhere: int
    """no basis has fewer base trajectories, whatever they are (packing)"""
    among_segments: int
    """no basis whose base trajectories are segments has fewer (fractional packing)"""
    seconds: float
    bound_seconds: float
    """[s] wall time of the cover, and of both bounds"""
    source: str
    """fingerprint of the segments"""

    @property
    def cumulative(self) -> Float[np.ndarray, " M"]:
        """Share of the segments that is nearest to the one, two, … most common base trajectories."""
        return np.cumsum(np.sort(self.share)[::-1])


def study_bases(
    segments: Segments, radii: Sequence[float], settings: BasisSettings | None = None, seed: int = 0
) -> tuple[StudiedBasis, ...]:
    """Make, verify and bound a basis for every different ε in ``radii``, ascending; the ε of the settings is not used.

    Raises:
        SettingError: there is no ε, or one is not a positive number.
    """
    settings = settings or BasisSettings()
    if not radii or not all(np.isfinite(radius) and radius > 0 for radius in radii):
        raise SettingError(f"a radius ε of a cover must be a positive number, got {list(radii)}; try 0.5")
    source = fingerprint(segments.points)
    studied: list[StudiedBasis] = []
    distinct = sorted(set(radii))
    for number, radius in enumerate(distinct):
        with part(number, len(distinct)):
            studied.append(_study(segments, settings.model_copy(update={"radius": float(radius)}), seed, source))
    return tuple(studied)


def _study(segments: Segments, settings: BasisSettings, seed: int, source: str) -> StudiedBasis:
    start = time.perf_counter()
    basis = make_basis(segments, settings, seed)
    made = time.perf_counter()
    scaled = basis.scaled(segments.points)
    anywhere = len(packing(scaled, settings.radius, seed))
    among_segments = max(anywhere, ceil(fractional_bound(scaled, settings.radius, seed=seed).value))
    bounded = time.perf_counter()
    nearest = replace(basis, reach=None).distance(segments.points).argmin(1)
    distance = np.linalg.norm(scaled - basis.scaled(basis.points)[nearest], axis=-1).max(-1)
    return StudiedBasis(
        basis=basis,
        share=np.bincount(nearest, minlength=len(basis)) / len(segments),
        covered=float((distance <= settings.radius).mean()),
        largest=float(distance.max()),
        anywhere=anywhere,
        among_segments=among_segments,
        seconds=made - start,
        bound_seconds=bounded - made,
        source=source,
    )


def point_table(studied: StudiedBasis) -> pl.DataFrame:
    """Columns: base, time [s], lon and lat [m] as deviation from constant velocity, share of the segments."""
    basis = studied.basis
    bases, points, _ = basis.points.shape
    return pl.DataFrame(
        {
            "base": np.repeat(np.arange(bases), points),
            "time": np.tile(basis.step * np.arange(points), bases),
            "lon": basis.points[..., 0].ravel(),
            "lat": basis.points[..., 1].ravel(),
            "share": np.repeat(studied.share, points),
        }
    )


def basis_record(studied: StudiedBasis) -> dict[str, Any]:
    """What was measured, as JSON values."""
    return {
        **studied.basis.tolerances,
        "bases": len(studied.basis),
        "at_least_among_segments": studied.among_segments,
        "at_least_anywhere": studied.anywhere,
        "covered": studied.covered,
        "largest_distance": studied.largest,
        "seconds": studied.seconds,
        "bound_seconds": studied.bound_seconds,
        "source": studied.source,
    }
