"""What a plan aims at for the time being, besides what the planner's settings say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from coverdrive.errors import SettingError


@dataclass(frozen=True)
class Wish:
    """What is wanted of one plan; it comes after keeping clear of everything."""

    speed: float | None = None
    """[m/s] wanted; None: the reference speed of the settings"""
    lanes: tuple[int, ...] = ()
    """lanes of which the nearest is to be reached; none: whichever is best"""
    lat: float | None = None
    """[m] where to be in these lanes; None: in their middle"""
    braking: float = 0.0
    """[m/s²] at which one slows down evenly from now on to stand in the end, so that a plan sees its end; 0: it may go
    on at the speed"""
    urgent: bool = False
    """whether speed and place count more than comfort, and than manners, as to be somewhere in time"""

    def __post_init__(self) -> None:
        """Refuse what is no number."""
        for name in ("speed", "lat", "braking"):
            if (value := getattr(self, name)) is not None and not np.isfinite(value):
                raise SettingError(f"{name} of a wish: expected a finite number, got {value}")

    def away(self, lanes: Sequence[int]) -> Int[np.ndarray, " n"]:
        """How many lanes it is from each of some lanes to the nearest one that is wanted."""
        return np.abs(np.subtract.outer(lanes, self.lanes)).min(1) if self.lanes else np.zeros(len(lanes), dtype=int)

    def places(self, lanes: Sequence[int], centres: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """lat [m] that is aimed at in each of some lanes, whose centres are given."""
        return centres if self.lat is None else np.where([lane in self.lanes for lane in lanes], self.lat, centres)


NO_WISH = Wish()
