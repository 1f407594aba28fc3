"""The rows of a recording as arrays: which follow one another, and whether positions, speeds and headings agree.

A *track* is a vehicle without a break in time; R is the number of rows, steps lead from one to the next.
"""

from functools import cached_property

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int, Num

from coverdrive.road import Road

LEAST_DRIFT, DRIFT = 3.0, 0.1
"""[m] and share of a track's way by which its speeds and headings may miss its end; recorded US-101 traffic stays
within 1.5 m"""

LEAST_JUMP, JUMP = 3.0, 0.3
"""[m] and share of its way by which a step may differ from the speeds at its ends; US-101: 1.2 m in 0.1 s"""

BACKWARDS = 5.0
"""[m] that a track may go back: noise of vehicles that stand still"""


class Rows:
    """The columns of a recording's table as arrays, and what moves between successive rows."""

    def __init__(self, table: pl.DataFrame, dt: float, road: Road):
        """Nothing is computed before it is asked for."""
        self.table, self.dt, self.road = table, dt, road

    def of(self, name: str) -> Num[np.ndarray, " R"]:
        """One column."""
        return self.table[name].to_numpy()

    def at(self, row: int) -> str:
        """Vehicle and time of a row, for messages."""
        return f"vehicle {self.table['vehicle'][row]} at {self.table['time'][row]:.6g} s"

    @cached_property
    def moment(self) -> Int[np.ndarray, " R"]:
        """Time in units of dt."""
        return np.rint(self.of("time") / self.dt).astype(np.int64)

    @cached_property
    def same(self) -> Bool[np.ndarray, " steps"]:
        """Whether the next row is of the same vehicle."""
        return np.diff(self.of("vehicle")) == 0

    @cached_property
    def goes_on(self) -> Bool[np.ndarray, " steps"]:
        """Whether the next row is the next of the same track."""
        return self.same & (np.diff(self.moment) == 1)

    @cached_property
    def starts(self) -> Int[np.ndarray, " tracks"]:
        """First row of every track."""
        return np.flatnonzero(np.concatenate([[True], ~self.goes_on]))

    @cached_property
    def moved(self) -> Float[np.ndarray, "2 steps"]:
        """[m] way along and across the road from each row to the next, 0 at the end of a track."""
        return np.stack([np.diff(self.of("lon")), np.diff(self.of("lat"))]) * self.goes_on

    @cached_property
    def way(self) -> Float[np.ndarray, " steps"]:
        """[m] to the next row by the speeds, 0 at the end of a track."""
        speed = self.of("speed")
        return (speed[1:] + speed[:-1]) / 2 * self.dt * self.goes_on

    def expected(self, heading: Float[np.ndarray, " R"]) -> Float[np.ndarray, "2 steps"]:
        """[m] way to the next row by the speeds and these headings [rad]."""
        velocity = self.of("speed") * np.stack([np.cos(heading), np.sin(heading)])
        return (velocity[:, 1:] + velocity[:, :-1]) / 2 * self.dt * self.goes_on

    def by_track(self, steps: Float[np.ndarray, "*n steps"]) -> Float[np.ndarray, "*n tracks"]:
        """Sums of what happens between rows over every track."""
        padded = np.concatenate([np.zeros((*steps.shape[:-1], 1)), steps], axis=-1)
        return np.add.reduceat(padded, self.starts, axis=-1)

    def off_course(self, heading: Float[np.ndarray, " R"]) -> Bool[np.ndarray, " tracks"]:
        """Tracks that do not end where their speeds and these headings [rad] lead."""
        missed = np.hypot(*self.by_track(self.moved - self.expected(heading)))
        return missed > LEAST_DRIFT + DRIFT * self.by_track(self.way)

    @cached_property
    def jumps(self) -> Bool[np.ndarray, " steps"]:
        """Steps that no vehicle makes at these speeds."""
        missed = np.hypot(*(self.moved - self.expected(self.of("heading"))))
        return missed > LEAST_JUMP + JUMP * self.way

    @cached_property
    def backwards(self) -> Bool[np.ndarray, " tracks"]:
        """Tracks against the direction of the road."""
        return self.by_track(self.moved[0]) < -BACKWARDS
