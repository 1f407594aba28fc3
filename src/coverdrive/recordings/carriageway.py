"""Tracks in map coordinates are told apart by their direction of travel, and find the road they drive on.

A road is as straight as a `ReferenceLine` can be (`LARGEST_BEND`). A reader may know lines along it, such as lane
markings; else the line follows the directions in which vehicles drive.
"""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float
from scipy.interpolate import make_smoothing_spline

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.recordings.reference_line import LARGEST_BEND, ReferenceLine, bend, reference_line
from coverdrive.recordings.repair import counted

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

SHORTEST_WAVE = 300.0
"""[m] wave length below which bends that only vehicles show are smoothed out: lane changes, not motorways"""


def split_directions(file: Path, table: pl.DataFrame, repairs: Counter[str]) -> list[pl.DataFrame]:
    """The rows of each direction of travel, that with more vehicles first.

    The table has the columns ``vehicle``, ``moment``, ``x`` and ``y`` [m], and is sorted by the first two. Vehicles
    that stand belong to the direction whose vehicles pass nearest. ``repairs`` gains ``crossing vehicles`` and
    ``vehicles the other way``.

    Raises:
        RecordingError: nothing moves, too much crosses the road, or vehicles drive both ways in the same place.
    """
    ends = pl.col("x", "y").last() - pl.col("x", "y").first()
    way = table.group_by("vehicle", maintain_order=True).agg(ends, pl.col("x", "y").mean().name.suffix("_mean"))
    moved = way.select("x", "y").to_numpy()
    moving = np.hypot(*moved.T) >= MOVING
    if not moving.any():
        problem = f"no vehicle moves by {MOVING:g} m or more; expected traffic, check that positions are in metres"
        raise RecordingError(file, problem)
    doubled = (moved[:, 0] + 1j * moved[:, 1])[moving] ** 2
    axis = np.sqrt(np.sum(doubled / np.abs(doubled) ** 0.5))  # twice the angle is the same for both directions
    axis /= np.abs(axis)
    turned = np.angle((moved[:, 0] + 1j * moved[:, 1]) / axis)
    forward = np.cos(turned) > 0
    crossing = moving & (np.abs(np.cos(turned)) < np.cos(np.radians(CROSSING)))
    if crossing.sum() > MOST_CROSSING * moving.sum():
        found = f"{crossing.sum()} of {moving.sum()} vehicles drive at more than {CROSSING:g}° to the others"
        raise RecordingError(file, f"{found}; expected one road that bends little, and no junction")
    counted(repairs, "crossing vehicles", int(crossing.sum()))
    sides = [moving & ~crossing & forward, moving & ~crossing & ~forward]
    sides.sort(key=np.sum, reverse=True)
    across = (way["x_mean"].to_numpy() + 1j * way["y_mean"].to_numpy()) / axis
    if sides[1].sum() <= FEW * moving.sum():
        counted(repairs, "vehicles the other way", int(sides[1].sum()))
        sides = [sides[0] | ~moving]
    else:
        standing = ~moving[:, None] & _nearest(across.imag, sides)
        sides = [side | standing[:, number] for number, side in enumerate(sides)]
    vehicles = [way["vehicle"].filter(pl.Series(side)) for side in sides]
    return [table.filter(pl.col("vehicle").is_in(own.implode())) for own in vehicles]


def _nearest(across: Float[np.ndarray, " V"], sides: list[np.ndarray]) -> np.ndarray:
    """Which side (V, 2) each vehicle is nearest to, by its mean position [m] across the road."""
    away = np.stack([np.abs(across - np.median(across[side])) for side in sides], axis=-1)
    return away == away.min(axis=-1, keepdims=True)


def check_apart(file: Path, line: ReferenceLine, sides: list[pl.DataFrame]) -> str:
    """Whether two carriageways keep to the right or to the left of each other; refused where they lie on one another.

    The line is that of the first one.
    """
    bounds = [np.quantile(line.project(side.select("x", "y").to_numpy())[:, 1], (0.05, 0.95)) for side in sides]
    if bounds[1][0] > bounds[0][1]:
        return "right"
    if bounds[1][1] < bounds[0][0]:
        return "left"
    problem = "vehicles drive both ways in the same place; expected two carriageways side by side"
    raise RecordingError(file, f"{problem}: leave out one direction, or choose another file")


def line_along(file: Path, table: pl.DataFrame, known: tuple[Line, ...]) -> ReferenceLine:
    """The line of the road of the vehicles of one direction: the longest of the known lines, or along the tracks.

    Raises:
        RecordingError: the road bends by more than `LARGEST_BEND`, or its length is that of no road.
    """
    ends = table.group_by("vehicle").agg(pl.col("x", "y").last() - pl.col("x", "y").first())
    travel = ends.select("x", "y").sum().to_numpy()[0]
    points = max(known, key=lambda line: float(np.hypot(*(line[-1] - line[0])))) if known else _followed(table, travel)
    if (points[-1] - points[0]) @ travel < 0:
        points = points[::-1]
    if not 1.0 <= float(np.sum(np.hypot(*np.diff(points, axis=0).T))) <= LONGEST_ROAD:
        raise RecordingError(file, f"the road is not between 1 m and {LONGEST_ROAD:g} m long; check the coordinates")
    turned = np.degrees(bend(points))
    if turned > LARGEST_BEND:
        found = f"the road bends by {turned:.0f}°; only roads that bend by at most {LARGEST_BEND:g}° can be read so far"
        raise RecordingError(file, f"{found}: choose a straight one, or cut the recording")
    return reference_line(points)


def _followed(table: pl.DataFrame, travel: Float[np.ndarray, " 2"]) -> Line:
    """Points along the road, `STRETCH` apart, in the median direction of those who drive from one stretch to the next.

    They drift off lanes by little, which `centred` puts right.
    """
    along = travel / np.hypot(*travel)
    u = pl.col("x") * along[0] + pl.col("y") * along[1]
    v = pl.col("y") * along[0] - pl.col("x") * along[1]
    places = (
        table.select("vehicle", u=u, v=v)
        .group_by("vehicle", (pl.col("u") / STRETCH).floor().cast(pl.Int64).alias("stretch"))
        .agg(pl.col("u", "v").mean())
        .sort("vehicle", "stretch")
    )
    change = pl.col("u", "v", "stretch").diff().over("vehicle").name.suffix("_step")
    steps = places.with_columns(change).filter(pl.col("stretch_step") == 1)
    at = (steps["u"] - steps["u_step"] / 2).to_numpy()
    slope = _smooth(at, (steps["v_step"] / steps["u_step"]).to_numpy())
    grid = np.arange(places["u"].to_numpy().min(), places["u"].to_numpy().max() + STRETCH, STRETCH)
    offset = np.concatenate([[0.0], np.cumsum(slope((grid[1:] + grid[:-1]) / 2) * STRETCH)])
    offset += places["v"].to_numpy().mean() - offset.mean()
    return np.stack([grid * along[0] - offset * along[1], grid * along[1] + offset * along[0]], axis=-1)


def centred(line: ReferenceLine, lon: Float[np.ndarray, " R"], beside: Float[np.ndarray, " R"]) -> ReferenceLine:
    """The line moved to the left by what most vehicles at each place ``lon`` [m] are to the left of their lanes [m]."""
    at = np.arange(0.0, line.chord + STRETCH, STRETCH)
    offset = line.offset(np.minimum(at, line.chord)) + _smooth(lon, beside)(at)
    return reference_line(line.start + at[:, None] * line.along + offset[:, None] * line.left)


def _smooth(at: Float[np.ndarray, " N"], values: Float[np.ndarray, " N"]) -> Callable[[np.ndarray], np.ndarray]:
    """A smooth curve through the medians of values over stretches of places [m]; beyond its ends, their values."""
    stretch = pl.Series(at / STRETCH).floor()
    medians = (
        pl.DataFrame({"stretch": stretch, "at": at, "value": values})
        .group_by("stretch")
        .agg(pl.col("at").mean(), pl.col("value").median(), rows=pl.len())
        .sort("at")
    )
    place, value, rows = (medians[name].to_numpy().astype(np.float64) for name in ("at", "value", "rows"))
    if len(medians) < 5:  # too few for a spline
        constant = float(np.average(value, weights=rows)) if len(medians) else 0.0
        return lambda places: np.full_like(places, constant)
    stiffness = (SHORTEST_WAVE / (2 * np.pi)) ** 4 / STRETCH
    curve = make_smoothing_spline(place, value, w=rows / rows.mean(), lam=stiffness)
    return lambda places: curve(np.clip(places, place[0], place[-1]))
