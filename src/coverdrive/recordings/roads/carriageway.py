"""Tracks in map coordinates are told apart by their direction of travel, and find the road they drive on.

A reader may know lines along the road, such as lane markings; else its line follows the directions in which vehicles
drive, and the middle of the lanes that they keep to.
"""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import polars as pl
from jaxtyping import Float
from scipy.interpolate import CubicSpline, make_smoothing_spline

from coverdrive.errors import RecordingError
from coverdrive.recordings.roads.line_fit import SPACING, fit_line
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road

Line = Float[np.ndarray, "P 2"]
"""Points [m] of a line in map coordinates"""

MOVING = 10.0
"""[m] from its first to its last position show in which direction a vehicle drives"""

CROSSING, MOST_CROSSING = 30.0, 0.1
"""[degrees] from the axis of the road, and the share of the moving vehicles that may drive so without its being a
junction"""

FEW = 0.1
"""Share of the moving vehicles up to which those that drive the other way are left out as strays"""

STRETCH = 20.0
"""[m] of the road over which the direction of every vehicle is taken"""

SHORTEST_WAVE, FINER_WAVES = 200.0, (100.0, 50.0, 50.0)
"""[m] wave lengths below which bends that only vehicles show are smoothed out: lane changes, not motorways; and those
with which the line goes on, one after the other, where the road bends more"""

FOLLOWINGS = 2
"""How often the line is put along the vehicles' directions with a wave length, from a straight one on"""

BENT, ENOUGH = 1.5, 3
"""[degrees] from the line in which so many vehicles or more may drive in the median; where it is more, the road bends
more. With 200 m it is up to 1.2° on US-101, 1.3° in curves of 300 m radius, 3° of 150 m; at last 1° in those of 80 m"""


def split_directions(
    file: Path, table: pl.DataFrame, repairs: Counter[str], known: tuple[Line, ...]
) -> list[pl.Series]:
    """The vehicles of each direction of travel, that with more of them first.

    The table has the columns ``vehicle``, ``moment``, ``x`` and ``y`` [m], and is sorted by the first two. Vehicles
    that stand belong to the direction whose vehicles pass nearest, across the road's line (`line_along`, of the known
    lines). ``repairs`` gains ``crossing vehicles`` and ``vehicles the other way``.

    Raises:
        DataError: the road's line, where it is needed, is none of a road.
        RecordingError: nothing moves, too much crosses the road, or no line follows the vehicles.
    """
    ends = pl.col("x", "y").last() - pl.col("x", "y").first()
    midway = pl.col("x", "y").get(pl.len() // 2).name.suffix("_midway")
    way = table.group_by("vehicle", maintain_order=True).agg(ends, midway)
    moved = way["x"].to_numpy() + 1j * way["y"].to_numpy()
    moving = np.abs(moved) >= MOVING
    if not moving.any():
        problem = f"no vehicle moves by {MOVING:g} m or more; expected traffic, check that positions are in metres"
        raise RecordingError(file, problem)
    doubled = moved[moving] ** 2
    axis = np.sqrt(np.sum(doubled / np.abs(doubled) ** 0.5))  # twice the angle is the same for both directions
    turned = np.angle(moved / axis)
    forward = np.cos(turned) > 0
    crossing = moving & (np.abs(np.cos(turned)) < np.cos(np.radians(CROSSING)))
    if crossing.sum() > MOST_CROSSING * moving.sum():
        found = f"{crossing.sum()} of {moving.sum()} vehicles drive at more than {CROSSING:g}° to the others"
        expected = "expected one road, no junction, that bends by little more than that where no map shows its bends"
        raise RecordingError(file, f"{found}; {expected}")
    repairs["crossing vehicles"] += int(crossing.sum())
    sides = [moving & ~crossing & forward, moving & ~crossing & ~forward]
    sides.sort(key=np.sum, reverse=True)
    if sides[1].sum() <= FEW * moving.sum():
        repairs["vehicles the other way"] += int(sides[1].sum())
        sides = [sides[0] | ~moving]
    elif not moving.all():
        ahead, back = (rows_of(table, way["vehicle"].filter(pl.Series(side))) for side in sides)
        line = line_along(file, pl.concat([ahead, back.reverse()]), known)  # where either drives
        across = line.to_road(way["x_midway"], way["y_midway"])[1]
        away = np.stack([np.abs(across - np.median(across[side])) for side in sides])
        sides = [side | (~moving & near) for side, near in zip(sides, away == away.min(axis=0), strict=True)]
    return [way["vehicle"].filter(pl.Series(side)) for side in sides]


def rows_of(table: pl.DataFrame, vehicles: pl.Series) -> pl.DataFrame:
    """The rows of some vehicles of a table."""
    return table.filter(pl.col("vehicle").is_in(vehicles.implode()))


def check_apart(file: Path, road: Road, other: pl.DataFrame) -> Literal["right", "left"]:
    """On which side of the traffic the other way the vehicles of a road keep; refused if that is on the road itself.

    Where it is beyond the ends of the road, which go straight on, it does not count if it is beside the road elsewhere.
    """
    lon, lat = road.to_road(other["x"], other["y"])
    beside = (lon >= 0) & (lon <= road.length)
    low, high = np.quantile(lat[beside] if beside.any() else lat, (0.05, 0.95))
    if low > road.edges[-1]:
        return "right"
    if high < road.edges[0]:
        return "left"
    problem = "vehicles drive both ways in the same place; expected two carriageways side by side"
    raise RecordingError(file, f"{problem}: leave out one direction, or choose another file")


def line_along(file: Path, table: pl.DataFrame, known: tuple[Line, ...]) -> ReferenceLine:
    """The line of the road of the vehicles of one direction: the longest of the known lines, or along the tracks.

    Raises:
        DataError: the road's length is that of no road, or it bends too sharply.
        RecordingError: vehicles turn more sharply than a line along them can.
    """
    ends = table.group_by("vehicle", maintain_order=True).agg(pl.col("x", "y").last() - pl.col("x", "y").first())
    travel = ends.select("x", "y").sum().to_numpy()[0]
    points = max(known, key=lambda line: float(np.hypot(*(line[-1] - line[0])))) if known else _chord(table, travel)
    if (points[-1] - points[0]) @ travel < 0:
        points = points[::-1]
    line = fit_line(points)
    if known:
        return line
    line = _followed(table, line, SHORTEST_WAVE)
    if _turned(table, line) <= BENT:
        return line
    for wave in FINER_WAVES:
        line = _followed(table, line, wave)
    turned = _turned(table, line)
    if turned > BENT:
        problem = f"the vehicles' way bends by {turned:.0f}° more than a road whose bends are estimated from tracks can"
        raise RecordingError(file, f"{problem}, as in curves below about 60 m radius; name its map, or leave it out")
    return line


def _chord(table: pl.DataFrame, travel: Float[np.ndarray, " 2"]) -> Line:
    """The ends of a straight line in a direction, along all positions."""
    along = travel / np.hypot(*travel)
    places = table.select("x", "y").to_numpy()
    way, middle = places @ along, places.mean(axis=0)
    return middle + (np.array([way.min(), way.max()]) - middle @ along)[:, None] * along


def _followed(table: pl.DataFrame, line: ReferenceLine, wave: float) -> ReferenceLine:
    """A line in the median direction of those who drive from one stretch to the next, all measured along a rough line.

    It drifts off lanes by little, which `centred` puts right.
    """
    for _ in range(FOLLOWINGS):
        lon, lat = line.to_road(table["x"], table["y"])
        slope = _smooth(*_slopes(table["vehicle"], lon, lat), wave)
        grid = np.arange(lon.min(), lon.max() + STRETCH, STRETCH)
        offset = np.concatenate([[0.0], np.cumsum(slope((grid[1:] + grid[:-1]) / 2) * STRETCH)])
        line = _moved(line, grid, offset + float(lat.mean() - offset.mean()))
    return line


def _turned(table: pl.DataFrame, line: ReferenceLine) -> float:
    """[degrees] from the line in which vehicles drive from a stretch to the next in the median, where most."""
    at, slope = _slopes(table["vehicle"], *line.to_road(table["x"], table["y"]))
    _, slope, rows = _medians(at + STRETCH / 2, slope)  # one group between any two stretches
    return float(np.degrees(np.arctan(np.abs(slope[rows >= ENOUGH]).max(initial=0.0))))


def _slopes(
    vehicle: pl.Series, lon: Float[np.ndarray, " R"], lat: Float[np.ndarray, " R"]
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """How much to the left of a line vehicles drive from one stretch to the next, and where [m]."""
    places = (
        pl.DataFrame({"vehicle": vehicle, "lon": lon, "lat": lat, "stretch": np.floor(lon / STRETCH)})
        .group_by("vehicle", "stretch")
        .agg(pl.col("lon", "lat").mean())
        .sort("vehicle", "stretch")
    )
    change = pl.col("lon", "lat", "stretch").diff().over("vehicle").name.suffix("_step")
    steps = places.with_columns(change).filter(pl.col("stretch_step") == 1)
    return (steps["lon"] - steps["lon_step"] / 2).to_numpy(), (steps["lat_step"] / steps["lon_step"]).to_numpy()


def centred(line: ReferenceLine, lon: Float[np.ndarray, " R"], beside: Float[np.ndarray, " R"]) -> ReferenceLine:
    """The line moved to the left by what most vehicles at each place ``lon`` [m] are to the left of their lanes [m]."""
    at = np.linspace(0.0, line.length, max(2, round(line.length / STRETCH) + 1))
    return _moved(line, at, _smooth(lon, beside, SHORTEST_WAVE)(at))


def _moved(line: ReferenceLine, lon: Float[np.ndarray, " G"], left: Float[np.ndarray, " G"]) -> ReferenceLine:
    """The line through points [m] to the left of places [m] on a line, without smoothing, which would straighten it."""
    fine = np.linspace(lon[0], lon[-1], max(4, round(float(np.ptp(lon)) / SPACING) + 1))
    x, y = line.to_map(fine, CubicSpline(lon, left)(fine))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    even = np.linspace(0.0, way[-1], len(way))
    (dx, ddx), (dy, ddy) = ((spline(even, 1), spline(even, 2)) for spline in (CubicSpline(way, x), CubicSpline(way, y)))
    curvature = (dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3
    return ReferenceLine(np.array([x[0], y[0]]), float(np.arctan2(dy[0], dx[0])), curvature, float(way[-1]))


def _medians(at: Float[np.ndarray, " N"], values: Float[np.ndarray, " N"]) -> tuple[Float[np.ndarray, " S"], ...]:
    """Mean place [m] of each stretch, the median of its values, and how many there are."""
    medians = (
        pl.DataFrame({"stretch": pl.Series(at / STRETCH).floor(), "at": at, "value": values})
        .group_by("stretch")
        .agg(pl.col("at").mean(), pl.col("value").median(), rows=pl.len())
        .sort("at")
    )
    return tuple(medians[name].to_numpy().astype(np.float64) for name in ("at", "value", "rows"))


def _smooth(
    at: Float[np.ndarray, " N"], values: Float[np.ndarray, " N"], wave: float
) -> Callable[[np.ndarray], np.ndarray]:
    """A curve of waves [m] no shorter, through medians of values over stretches of places [m], straight on beyond."""
    place, value, rows = _medians(at, values)
    if len(place) < 5:  # too few for a spline
        constant = float(np.average(value, weights=rows)) if len(place) else 0.0
        return lambda places: np.full_like(places, constant)
    stiffness = (wave / (2 * np.pi)) ** 4 / STRETCH
    curve = make_smoothing_spline(place, value, w=rows / rows.mean(), lam=stiffness)

    def straight_on(places: np.ndarray) -> np.ndarray:
        inside = np.clip(places, place[0], place[-1])
        return curve(inside) + curve(inside, 1) * (places - inside)

    return straight_on
