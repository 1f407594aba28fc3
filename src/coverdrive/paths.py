"""Predicted paths: what prediction hands to planning.

S paths of P = K + 1 points each: the start and the K steps of the plan. Several paths belong to one vehicle, the
members of its predicted set.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float, Int

from coverdrive.errors import SettingError


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class PredictedPaths:
    """Where every surrounding vehicle may be at every step of the plan."""

    points: Float[np.ndarray, "S P 2"]
    """[m] centre (lon, lat) at the times k·dt"""
    vehicle: Int[np.ndarray, " S"]
    """slot of the vehicle in the scene the prediction was made from"""
    half_sizes: Float[np.ndarray, "S P 2"]
    """[m] half extent along lon and lat of the box around the point in which the whole body is predicted to stay, as if
    the road were straight; where it bends, `coverdrive.geometry.bent_half_sizes` of them hold the body on the ground"""
    dt: float
    """[s] between two points"""
    ellipses: Float[np.ndarray, "S P 2"] | None = None
    """[m] half axes along lon and lat of the ellipse around the point in which the centre is predicted to stay besides;
    planning keeps clear of the whole box. None: the centre may be anywhere"""
    weight: Float[np.ndarray, " S"] | None = None
    """how likely the path is among those of its vehicle, up to a factor for each vehicle. None: all are alike"""

    def __len__(self) -> int:
        """Number of paths S."""
        return self.points.shape[0]

    def check_times(self, dt: float, steps: int) -> None:
        """Refuse points that are not at the times k·``dt`` [s], k = 0 … K = ``steps``, of a plan, by `SettingError`."""
        points = self.points.shape[1]
        if points != steps + 1 or abs(self.dt - dt) > 1e-9:
            raise SettingError(
                f"the predicted paths have {points} points every {self.dt} s, the plan needs {steps + 1} every {dt} s; "
                "predict with the planner's steps and dt"
            )

    def of(self, keep: np.ndarray) -> "PredictedPaths":
        """The paths selected by an index or boolean array over S."""
        ellipses, weight = (None if each is None else each[keep] for each in (self.ellipses, self.weight))
        return PredictedPaths(self.points[keep], self.vehicle[keep], self.half_sizes[keep], self.dt, ellipses, weight)

    def joined(self, other: "PredictedPaths") -> "PredictedPaths":
        """These paths and more of the same times; boxes count, ellipses are forgotten."""
        weights = [np.ones(len(each)) if each.weight is None else each.weight for each in (self, other)]
        return PredictedPaths(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.vehicle, other.vehicle]),
            np.concatenate([self.half_sizes, other.half_sizes]),
            self.dt,
            weight=np.concatenate(weights),
        )


def together(parts: Sequence[PredictedPaths]) -> PredictedPaths:
    """Paths of the same times behind one another; ellipses and weights say what they mean where a part has none."""
    ellipses = weight = None
    if any(each.ellipses is not None for each in parts):
        ellipses = np.concatenate(
            [np.full_like(each.points, np.inf) if each.ellipses is None else each.ellipses for each in parts]
        )
    if any(each.weight is not None for each in parts):
        weight = np.concatenate([np.ones(len(each)) if each.weight is None else each.weight for each in parts])
    points, vehicle, half_sizes = (
        np.concatenate([getattr(each, name) for each in parts]) for name in ("points", "vehicle", "half_sizes")
    )
    return PredictedPaths(points, vehicle, half_sizes, parts[0].dt, ellipses, weight)
