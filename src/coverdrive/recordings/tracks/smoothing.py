"""Savitzky–Golay smoothing of recorded tracks: raw NGSIM positions are too noisy to differentiate.

Speed and heading are the derivative of the polynomial that is fitted to the positions around each sample
(Savitzky & Golay 1964). Many tracks of different lengths lie one after the other in flat arrays of R rows and
are smoothed together. The window is centred at the sample, so that the result knows the future: it says what vehicles
did, and `coverdrive.recordings.tracks.filtering` what could be seen of them.
"""

from functools import cache

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from coverdrive.settings import Settings

STAND_STILL = 1.0
"""[m/s] below this speed the direction of motion is noise and the heading is 0"""

SLOW = 3.0
"""[m/s] speed at which the direction of motion is half noise: that of a lateral speed (0.1 m/s) over how far headings
on a motorway spread (0.035 rad)"""


class SmoothingSettings(Settings):
    """How recorded positions are smoothed."""

    window: float = Field(default=1.7, gt=0, le=20)
    """[s] length of the fitted window, taken to the nearest odd number of samples; the noise of NGSIM positions
    is mostly faster than 1 s (Thiemann, Treiber & Kesting 2008), real manoeuvres are slower than 2 s"""
    order: int = Field(default=3, ge=1, le=5)
    """order of the fitted polynomial"""
    position_noise: float = Field(default=0.1, gt=0, le=5)
    """[m] of a measured position, for what is seen at a moment (`coverdrive.recordings.tracks.filtering`)"""
    acceleration_noise: float = Field(default=4.0, gt=0, le=100)
    """[m/s^1.5] of the white acceleration of vehicles, for the same"""

    def samples(self, dt: float) -> int:
        """The window as an odd number of samples, at least 3 and more than the order of the polynomial."""
        half = max(1, round((self.window / dt - 1) / 2), (self.order + 1) // 2)
        return 2 * half + 1


def smooth(
    values: Float[np.ndarray, " R"], starts: Int[np.ndarray, " tracks"], dt: float, settings: SmoothingSettings
) -> tuple[Float[np.ndarray, " R"], Float[np.ndarray, " R"]]:
    """Smoothed values and their time derivative.

    Each track of at least two samples, dt [s] apart, begins at one of the rows ``starts``, the first one at row 0.
    """
    window = settings.samples(dt)
    half = window // 2
    counts = np.diff(np.append(starts, len(values)))
    smoothed, slope = np.empty_like(values), np.empty_like(values)
    fit, fit_slope = _fit(window, settings.order, dt)
    if len(values) >= window:
        inner = slice(half, len(values) - half)
        smoothed[inner] = np.convolve(values, fit[half, ::-1], mode="valid")
        slope[inner] = np.convolve(values, fit_slope[half, ::-1], mode="valid")
    whole = starts[counts >= window]
    ends = whole + counts[counts >= window] - window
    for rows, kept in ((whole, slice(0, half)), (ends, slice(window - half, window))):
        index = rows[:, None] + np.arange(window)
        smoothed[index[:, kept]] = values[index] @ fit[kept].T
        slope[index[:, kept]] = values[index] @ fit_slope[kept].T
    for count in np.unique(counts[counts < window]):
        order = max(1, min(settings.order, (int(count) - 1) // 2))
        fit, fit_slope = _fit(int(count), order, dt)
        index = starts[counts == count][:, None] + np.arange(count)
        smoothed[index] = values[index] @ fit.T
        slope[index] = values[index] @ fit_slope.T
    return smoothed, slope


def motion(
    lon_rate: Float[np.ndarray, " R"], lat_rate: Float[np.ndarray, " R"]
) -> tuple[Float[np.ndarray, " R"], Float[np.ndarray, " R"]]:
    """Speed [m/s] and heading [rad] of velocities [m/s] along and across the road.

    The slower a vehicle, the less of its direction of motion is heading, and the more is noise of the lateral speed:
    the heading is the mean of what it may be, if both are normally distributed.
    """
    speed = np.hypot(lon_rate, lat_rate)
    share = speed**2 / np.maximum(speed**2 + SLOW**2, 1e-12)
    heading = np.where(speed < STAND_STILL, 0.0, np.arctan2(share * lat_rate, lon_rate))
    return speed, heading


@cache
def _fit(count: int, order: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (count, count) from samples to the fitted polynomial's values and slopes at the samples."""
    powers = np.arange(order + 1)
    position = (np.arange(count) - (count - 1) / 2) * dt
    design = position[:, None] ** powers
    solve = np.linalg.pinv(design)
    rate = np.zeros_like(design)
    rate[:, 1:] = powers[1:] * position[:, None] ** powers[:-1]
    return design @ solve, rate @ solve
