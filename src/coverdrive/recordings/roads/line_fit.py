"""A smooth reference line along the points of a drawn map, or along estimated ones.

Digitised lines have kinks that no road has: x and y become cubic smoothing splines over the way, which pass waves of a
length and smooth out shorter ones. Of the lengths in `WAVES` the longest is taken with which the line stays within
`TOLERANCE` of what was drawn. Such splines end straight: a line that bends is drawn on as an arc at both ends
meanwhile; one that counts as straight is not, as the noise at its ends would lead the arc astray. P is the number of
points.
"""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from coverdrive.errors import DataError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.reference_line import ReferenceLine

STRAIGHT = 15.0
"""[degrees] between any two directions of a line that still counts as straight"""

TOLERANCE = 0.3
"""[m] by which smoothing may move the line; lanes do not move with it, as their edges are measured from it"""

WAVES = (80.0, 57.0, 40.0, 28.0, 20.0, 14.0, 10.0)
"""[m] wave length that keeps half its height; bends of freeways are longer than the first"""

BEYOND = 40.0
"""[m] by which the line is drawn on at both ends while it is smoothed"""

SPACING = 1.0
"""[m] between the points of the line"""


def fit_line(points: Float[np.ndarray, "P 2"]) -> ReferenceLine:
    """The smooth line along points [m] in map coordinates, in the order of travel.

    A DataError if the points are no line, or bend more than a road does (`coverdrive.reference_line.SMALLEST_RADIUS`).
    """
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    if not 1.0 <= way[-1] <= LONGEST_ROAD:
        raise DataError(f"the road is not between 1 m and {LONGEST_ROAD:g} m long; check the coordinates")
    apart = np.insert(np.diff(way) > 0, 0, True)
    grid = np.linspace(0.0, way[-1], max(6, round(way[-1] / SPACING) + 1))
    drawn = np.stack([np.interp(grid, way[apart], values[apart]) for values in points.T])
    line = _fitted(grid, drawn, BEYOND)
    return line if np.degrees(line.bend) > STRAIGHT else _fitted(grid, drawn, 0.0)


def _fitted(grid: Float[np.ndarray, " G"], drawn: Float[np.ndarray, "2 G"], beyond: float) -> ReferenceLine:
    """The line of the longest of the `WAVES` that stays within the tolerance, drawn on by ``beyond`` [m] meanwhile."""
    for wave in WAVES:
        try:
            line = _smoothed(grid, drawn, wave, beyond)
        except DataError:
            if wave == WAVES[-1]:
                raise
            continue
        if np.abs(line.to_road(*drawn)[1]).max() <= TOLERANCE:
            return line
    raise DataError(
        f"the line turns too sharply for a road; expected one that a curve of {WAVES[-1]:g} m long waves follows "
        f"within {TOLERANCE:g} m: check its points, or leave the junction out"
    )


def _smoothed(
    grid: Float[np.ndarray, " G"], drawn: Float[np.ndarray, "2 G"], wave: float, beyond: float
) -> ReferenceLine:
    """The line of the splines that keep half of waves of a length [m], through points at ways ``grid`` [m]."""
    step = grid[1] - grid[0]
    ways = step * np.arange(1, round(beyond / step) + 1)
    before, after = _beyond(drawn[:, ::-1], ways)[:, ::-1], _beyond(drawn, ways)
    longer = np.concatenate([grid[0] - ways[::-1], grid, grid[-1] + ways])
    values = np.concatenate([before, drawn, after], axis=1)
    spline = CubicSpline(longer, _even(values, step, (wave / (2 * np.pi)) ** 4), axis=1, bc_type="natural")
    fine = np.linspace(0.0, grid[-1], 4 * len(grid))
    (dx, dy), (ddx, ddy) = spline(fine, 1), spline(fine, 2)
    rate = np.hypot(dx, dy)
    arc = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(fine))])
    even = np.linspace(0.0, arc[-1], max(2, int(np.ceil(arc[-1] / SPACING)) + 1))
    curvature = np.interp(even, arc, (dx * ddy - dy * ddx) / rate**3)
    return ReferenceLine(spline(0.0), float(np.arctan2(dy[0], dx[0])), curvature, float(arc[-1]))


def _even(values: Float[np.ndarray, "2 G"], step: float, weight: float) -> Float[np.ndarray, "2 G"]:
    """Values [m] at even steps [m] as the natural cubic splines pass them that smooth them (Reinsch 1967).

    As `scipy.interpolate.make_smoothing_spline` does at any steps, point by point, which takes a minute for 100 km. The
    splines trade their distance from the values for their bending, which counts by a ``weight`` [m⁴].
    """
    ratio, bands = weight / step**3, np.zeros((3, values.shape[1] - 2))
    bands[0, 2:], bands[1, 1:], bands[2] = ratio, step / 6 - 4 * ratio, 2 * step / 3 + 6 * ratio
    bending = solveh_banded(bands, np.diff(values, 2).T / step)
    return values - weight / step**2 * np.diff(np.pad(bending.T, ((0, 0), (2, 2))), 2)


def _beyond(drawn: Float[np.ndarray, "2 G"], ways: Float[np.ndarray, " W"]) -> Float[np.ndarray, "2 W"]:
    """Points at ways [m] beyond the last one, on the arc that as many points before it lead to."""
    if len(ways) == 0:
        return np.zeros((2, 0))
    last = drawn[:, -max(3, len(ways)) :]
    chord = last[:, -1] - last[:, 0]
    along = chord / np.hypot(*chord)
    ahead, left = along @ (last - last[:, -1:]), np.array([-along[1], along[0]]) @ (last - last[:, -1:])
    bend, slope, _ = np.polyfit(ahead, left, 2)
    heading = np.arctan2(along[1], along[0]) + np.arctan(slope)
    curvature = 2 * bend / (1 + slope**2) ** 1.5
    middle = heading + curvature * (ways - ways[0] / 2)
    return drawn[:, -1:] + np.cumsum(ways[0] * np.stack([np.cos(middle), np.sin(middle)]), axis=1)
