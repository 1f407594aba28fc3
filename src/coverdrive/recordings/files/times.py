"""The times of rows, which files round in their own ways: the time between two frames, and the frame of every row."""

from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.errors import RecordingError
from coverdrive.recordings.tracks.reading import check_time_step

MOST_UNEVEN = 0.02
"""Share of the rows whose time may be farther than a quarter of a step from a multiple of it"""

SINGLE = 1.75
"""Longer steps, in usual ones, pass over a frame; shorter ones differ by rounding"""

FIRST, GROWTH = 16, 1.5
"""Frames to which a step is fitted first, and the factor by which they become more"""

AS_GOOD, EXACT = 1.1, 1e-6
"""Times are as near to the multiples of a plain step as to those of the fitted one: a factor, and [s]"""

ROUNDING, UNLIKE = (1.0, 0.1, 0.01, 0.001), 0.02
"""[s] to which times may be rounded, and share of a step by which they may miss one more"""


def time_step(file: Path, table: pl.DataFrame, what: str) -> float:
    """[s] between two frames, from the ``clock`` [s] of every row, which may be rounded to less than half of it."""
    some = table["vehicle"].unique(maintain_order=True).head(100)
    tracks = table.select("vehicle", "clock").filter(pl.col("vehicle").is_in(some.implode())).sort("vehicle", "clock")
    steps = np.diff(tracks["clock"].to_numpy())[np.diff(tracks["vehicle"].to_numpy()) == 0]
    steps = steps[steps > 0]
    if not len(steps):
        raise RecordingError(file, "no vehicle was seen at two times; check that the file was copied whole")
    single = steps[steps < SINGLE * np.median(steps)]
    dt = _fitted(table["clock"].unique().sort().to_numpy(), float(single.mean()))
    check_time_step(file, dt, f"the time between two rows of a vehicle ({what})")
    return dt


def moments_of(file: Path, clock: Float[np.ndarray, " R"], dt: float) -> Int[np.ndarray, " R"]:
    """The moments nearest to the times of rows [s] in steps of ``dt`` [s].

    Refused if many are between two, farther from the first row's than a quarter of a step or than rounding explains.
    """
    steps = clock / dt
    steps -= steps[0] - np.rint(steps[0])
    if _uneven(steps, 0.25):
        steps -= np.angle(np.exp(2j * np.pi * steps).mean()) / (2 * np.pi)  # the first row's own rounding
        if _uneven(steps, min(_rounding(clock) / dt / 2 + UNLIKE, 0.45)):
            problem = f"the times of the rows are not multiples of {dt:g} s apart; expected one frame rate for all"
            raise RecordingError(file, f"{problem} vehicles: resample the tracks")
    return np.rint(steps).astype(np.int64)


def _uneven(steps: Float[np.ndarray, " R"], most: float) -> bool:
    """Whether many times miss whole steps by more than so much of one."""
    return bool(np.mean(np.abs(steps - np.rint(steps)) > most) > MOST_UNEVEN)


def _rounding(clock: Float[np.ndarray, " R"]) -> float:
    """[s] to which times are rounded; 0 if that is less than a millisecond, or not at all."""
    scaled = ((unit, clock / unit) for unit in ROUNDING)
    return next((unit for unit, each in scaled if np.abs(each - np.rint(each)).max() < UNLIKE), 0.0)


def _fitted(times: Float[np.ndarray, " T"], dt: float) -> float:
    """[s] the step of the regular times that are nearest to ascending ones, from one that is nearly right.

    A whole number of them is 1 s, if that fits as well.
    """
    times, start, frames = times - times[0], 0.0, float(FIRST)
    while True:
        part = times[: np.searchsorted(times, start + (frames + 0.5) * dt)]
        number = np.rint((part - start) / dt)
        if number[-1] > number[0]:
            dt, start = map(float, np.polyfit(number, part, 1))
        if len(part) == len(times):
            break
        frames *= GROWTH

    number = np.rint((times - start) / dt)

    def missed(step: float) -> float:
        off = times - number * step
        return float(np.quantile(np.abs(off - np.median(off)), 1 - MOST_UNEVEN))

    plain = (1 / max(1, round(1 / dt)), round(dt, 9))
    return next((step for step in plain if missed(step) <= AS_GOOD * missed(dt) + EXACT), dt)
