"""A straight road of parallel lanes, in the road frame.

The road frame is right-handed: ``lon`` [m] runs along the road, ``lat`` [m] to the left, ``heading`` [rad] turns
counter-clockwise from the road's direction. Lanes are numbered from the right edge, starting at 0.
"""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax import Array
from jaxtyping import Float, Int

from coverdrive.errors import SettingError


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Road:
    """Lane edges and length of a road; L lanes have E = L + 1 edges."""

    edges: Float[Array | np.ndarray, " E"]
    """lat [m] of the lane edges, from the right edge of the road to the left, strictly ascending"""
    length: float | Float[Array, ""]
    """[m]"""

    @property
    def lanes(self) -> int:
        """Number of lanes L."""
        return self.edges.shape[0] - 1

    @property
    def centres(self) -> Float[Array | np.ndarray, " L"]:
        """lat [m] of the lane centres."""
        return (self.edges[:-1] + self.edges[1:]) / 2

    def lane_of(self, lat: Any) -> Int[Any, "..."]:
        """Lane index of every lateral position, of any shape; positions off the road belong to the nearest lane."""
        inner = self.edges[1:-1]
        return (lat[..., None] >= inner).sum(-1)

    def mirrored(self) -> "Road":
        """The same road with left and right exchanged (lat → −lat)."""
        return Road(edges=-self.edges[::-1], length=self.length)

    @staticmethod
    def straight(lanes: int = 3, width: float = 3.6, length: float = 1000.0) -> "Road":
        """A road of equal lanes whose right edge is at lat = 0; 3.6 m is the US freeway standard (AASHTO)."""
        if lanes < 1 or width <= 0 or length <= 0:
            raise SettingError(
                f"a road needs at least one lane, and a positive width and length; got {lanes} lanes, "
                f"{width} m, {length} m"
            )
        return Road(edges=np.arange(lanes + 1) * float(width), length=length)
