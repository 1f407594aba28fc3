"""What a plan aims at for the time being, besides what the planner's settings say."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Wish:
    """What is wanted of one plan; it comes after keeping clear of everything."""

    speed: float | None = None
    """[m/s] wanted; None: the reference speed of the settings"""
    lanes: tuple[int, ...] = ()
    """lanes of which the nearest is to be reached; none: whichever is best"""

    def away(self, lane: int) -> int:
        """How many lanes it is from a lane to the nearest one that is wanted."""
        return min((abs(lane - each) for each in self.lanes), default=0)


NO_WISH = Wish()
