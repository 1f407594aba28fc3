"""The vehicles on a road at one moment, as a struct of arrays with any leading batch axes.

Positions are vehicle centres in the road frame (see `coverdrive.road`). A is the number of vehicle slots; slots
that hold no vehicle have ``valid`` False and arbitrary finite values.
"""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax import Array
from jaxtyping import Bool, Float


def beside(*columns: Any) -> np.ndarray:
    """Arrays of the same shape and type, beside one another along a new last axis: `np.stack` without its questions."""
    first = np.asarray(columns[0])
    result = np.empty((*first.shape, len(columns)), first.dtype)
    for i, column in enumerate(columns):
        result[..., i] = column
    return result


Values = Float[Array | np.ndarray, "*batch A"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Scene:
    """Where every vehicle is, how fast it drives and how large it is."""

    lon: Values
    """[m] centre along the road"""
    lat: Values
    """[m] centre to the left"""
    speed: Values
    """[m/s] along the heading"""
    heading: Values
    """[rad] counter-clockwise from the road's direction"""
    length: Values
    """[m]"""
    width: Values
    """[m]"""
    valid: Bool[Array | np.ndarray, "*batch A"]
    """whether the slot holds a vehicle"""

    @property
    def vehicles(self) -> int:
        """Number of slots A, valid or not."""
        return self.lon.shape[-1]

    @property
    def measures(self) -> tuple[Values, Values, Values, Values, Values, Values]:
        """All fields but ``valid``."""
        return self.lon, self.lat, self.speed, self.heading, self.length, self.width

    @property
    def states(self) -> Float[np.ndarray, "*batch A 4"]:
        """The state (lon, lat, speed, heading) of every slot."""
        return beside(self.lon, self.lat, self.speed, self.heading)

    def state_of(self, slot: int) -> Float[np.ndarray, "*batch 4"]:
        """The state of one slot."""
        return beside(*(each[..., slot] for each in (self.lon, self.lat, self.speed, self.heading)))

    @property
    def half_sizes(self) -> Float[np.ndarray, "*batch A 2"]:
        """Half length and half width [m] of every slot."""
        return beside(self.length, self.width) / 2

    def mirrored(self) -> "Scene":
        """The same scene with left and right exchanged (lat → −lat)."""
        return Scene(self.lon, -self.lat, self.speed, -self.heading, self.length, self.width, self.valid)

    def padded(self, multiple: int) -> "Scene":
        """The same scene with invalid slots appended until their number is a multiple of ``multiple``.

        Compiled functions are specialised to array shapes; padding keeps the number of different shapes small.
        """
        missing = -self.vehicles % multiple
        return jax.tree.map(lambda each: np.pad(each, [(0, 0)] * (each.ndim - 1) + [(0, missing)]), self)
