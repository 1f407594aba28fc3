"""What every recording must be, checked whenever one is made: the right units, regular tracks, vehicles on the road.

A check looks at the whole table at once and says what is wrong with it, or nothing. The limits are those of road
traffic, wide enough for trucks, motorcycles and measurement noise, and narrow enough to tell metres from feet, seconds
from milliseconds and m/s from km/h.
"""

from collections.abc import Callable

import numpy as np
import polars as pl
from jaxtyping import Int

from coverdrive.errors import DataError
from coverdrive.recordings.rows import LEAST_DRIFT, Rows
from coverdrive.road import Road

TIME_STEPS = (0.02, 1.0)
"""[s] 50 Hz to 1 Hz: cameras and drones give 10 to 30 Hz; at less than 1 Hz a lane change is a few points"""

LATEST = 1e10
"""[s] POSIX times are below 2e9 s, the same in milliseconds above 1e12"""

LENGTHS, WIDTHS = (1.0, 60.0), (0.4, 4.0)
"""[m] motorcycles of NGSIM to Australian road trains (53.5 m); handlebars to vehicles of excess width"""

LANE_WIDTHS = (2.0, 7.5)
"""[m] lanes are 2.7 to 3.6 m wide on roads (AASHTO Green Book), narrower in road works, wider on ramps"""

LONGEST_ROAD = 200_000.0
"""[m]"""

FASTEST = 90.0
"""[m/s] 324 km/h"""

BESIDE, BEYOND = 5.0, 200.0
"""[m] vehicles may be this far beside the outer edges (a hard shoulder), and beyond the ends of the road"""

SYSTEMATIC = 0.1
"""Share of the steps that jump from which on headings are wrong, and not positions"""

SPEED_UNITS = {"km/h": 1 / 3.6, "mph": 0.44704, "ft/s": 0.3048}
"""[m/s] of the units in which speeds are stated by mistake"""


def check(table: pl.DataFrame, dt: float, road: Road) -> None:
    """Refuse a table that cannot be traffic on this road.

    Args:
        table: as `coverdrive.recordings.recording.SCHEMA` says.
        dt: [s] between two rows of a track.
        road: that the vehicles drive on.

    Raises:
        DataError: names vehicle and time of the first row that is wrong, what was expected and what to try.

    """
    rows = Rows(table, dt, road)
    for problem in (found for one in CHECKS if (found := one(rows))):
        raise DataError(problem)


def implausible_vehicles(table: pl.DataFrame, dt: float, road: Road) -> Int[np.ndarray, " vehicles"]:
    """Numbers of the vehicles that jump, drift, speed or drive backwards as no vehicle does."""
    rows = Rows(table, dt, road)
    tracks = rows.backwards | rows.off_course(rows.of("heading"))
    wrong = np.concatenate([rows.of("vehicle")[rows.starts[tracks]], rows.of("vehicle")[:-1][rows.jumps]])
    return np.unique(np.concatenate([wrong, rows.of("vehicle")[rows.of("speed") > FASTEST]]))


def _time_step(rows: Rows) -> str | None:
    if TIME_STEPS[0] <= rows.dt <= TIME_STEPS[1]:
        return None
    return f"the time step is {rows.dt:g} s; expected {TIME_STEPS[0]} to {TIME_STEPS[1]:g} s: give times in seconds"


def _road(rows: Rows) -> str | None:
    edges = np.asarray(rows.road.edges, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or not np.isfinite(edges).all() or np.any(np.diff(edges) <= 0):
        return f"the lane edges are {edges.tolist()}; expected two or more, ascending from the right edge of the road"
    if abs(edges[0]) > 0.01:
        return f"the right edge of the road is at lat = {edges[0]:g} m; expected 0: subtract it from edges and lat"
    for lane, width in enumerate(np.diff(edges)):
        if not LANE_WIDTHS[0] <= width <= LANE_WIDTHS[1]:
            hint = "; are these feet? multiply by 0.3048" if 8 <= width <= 25 else "; check the unit of the edges"
            return f"lane {lane} is {width:g} m wide; expected {LANE_WIDTHS[0]:g} to {LANE_WIDTHS[1]:g} m{hint}"
    if not 0 < float(rows.road.length) <= LONGEST_ROAD:
        return f"the road is {float(rows.road.length):g} m long; expected more than 0 and up to {LONGEST_ROAD:g} m"
    return None


def _some(rows: Rows) -> str | None:
    return None if len(rows.table) else "the table holds no rows; expected at least one vehicle"


def _finite(rows: Rows) -> str | None:
    for name, column in zip(rows.table.columns, rows.table, strict=True):
        wrong = column.is_null() | (~column.is_finite() if column.dtype.is_float() else False)
        if wrong.any():
            row = int(wrong.arg_max() or 0)
            vehicle = rows.table["vehicle"][row]
            return (
                f"{name} of vehicle {vehicle} in row {row} is {column[row]}; expected a number: remove the row, and "
                "give what comes after the gap another vehicle number"
            )
    return None


def _numbers(rows: Rows) -> str | None:
    lowest = int(rows.of("vehicle").min())
    return None if lowest >= 0 else f"a vehicle has the number {lowest}; expected 0 or more: number the vehicles anew"


def _order(rows: Rows) -> str | None:
    time = rows.of("time")
    late = np.abs(time) > LATEST
    if late.any():
        return f"{rows.at(int(late.argmax()))}: expected seconds; divide milliseconds by 1000"
    if np.any(np.diff(rows.of("vehicle")) < 0) or np.any(rows.same & (np.diff(time) < 0)):
        row = int(np.argmax((np.diff(rows.of("vehicle")) < 0) | (rows.same & (np.diff(time) < 0)))) + 1
        return f"{rows.at(row)} comes after {rows.at(row - 1)}; expected rows in order: sort by vehicle and time"
    off_grid = np.abs(time / rows.dt - rows.moment) > 0.01
    if off_grid.any():
        row = int(off_grid.argmax())
        return (
            f"{rows.at(row)} is between two time steps; expected multiples of dt = {rows.dt:g} s: resample the tracks"
        )
    twice = rows.same & (np.diff(rows.moment) == 0)
    if twice.any():
        return f"{rows.at(int(twice.argmax()))} has two rows; expected one: remove the other"
    gap = rows.same & (np.diff(rows.moment) > 1) & (np.diff(rows.of("group")) == 0)
    if gap.any():
        row = int(gap.argmax())
        return (
            f"{rows.at(row)} is next seen at {time[row + 1]:.6g} s; expected a row every {rows.dt:g} s: fill the gap, "
            "or give the vehicle another number after it"
        )
    return None


def _sizes(rows: Rows) -> str | None:
    length, width = rows.of("length"), rows.of("width")
    if np.median(width) > np.median(length):
        return "most vehicles are wider than long; expected length along the heading: swap the columns length and width"
    for name, values, (least, most) in (("length", length, LENGTHS), ("width", width, WIDTHS)):
        wrong = (values < least) | (values > most)
        if wrong.any():
            row = int(wrong.argmax())
            hint = ": these look like feet, multiply by 0.3048" if wrong.mean() > 0.5 and values[row] > most else ""
            return f"the {name} of {rows.at(row)} is {values[row]:g} m; expected {least:g} to {most:g} m{hint}"
    return None


def _turned(rows: Rows) -> str | None:
    wrong = np.abs(rows.of("heading")) > np.pi + 1e-6
    if not wrong.any():
        return None
    row = int(wrong.argmax())
    return (
        f"the heading of {rows.at(row)} is {rows.of('heading')[row]:g} rad; expected −π to π: multiply degrees by π/180"
    )


def _units(rows: Rows) -> str | None:
    """Speeds against positions, over all vehicles: the ratio tells the unit."""
    stated, seen = float(np.sum(rows.way)), float(np.sum(np.hypot(*rows.by_track(rows.moved))))
    if abs(stated - seen) <= 0.2 * max(stated, seen) + LEAST_DRIFT * len(rows.starts):
        return None
    ratio = seen / stated if stated > 0 else np.inf
    found = f"vehicles move {ratio:.3g} times as far as their speeds say ({seen:.0f} m instead of {stated:.0f} m)"
    near = {name: abs(np.log(ratio / unit)) for name, unit in SPEED_UNITS.items()} if 0 < ratio < np.inf else {}
    unit = min(near, key=lambda name: near[name], default="")
    if near and near[unit] < 0.05:
        return f"{found}; the speeds look like {unit}: multiply them by {SPEED_UNITS[unit]:.4g}"
    if near and abs(np.log(ratio * 0.3048)) < 0.05:
        return f"{found}; the positions look like feet: multiply lon, lat and sizes by 0.3048"
    return f"{found}; expected the same: check that lon and lat are in m, speeds in m/s and dt = {rows.dt:g} in s"


def _fast(rows: Rows) -> str | None:
    speed = rows.of("speed")
    wrong = (speed < 0) | (speed > FASTEST)
    if not wrong.any():
        return None
    row = int(wrong.argmax())
    return f"the speed of {rows.at(row)} is {speed[row]:g} m/s; expected 0 to {FASTEST:g} m/s along its heading"


def _jumps(rows: Rows) -> str | None:
    if not rows.jumps.any():
        return None
    row = int(rows.jumps.argmax())
    way = np.hypot(*rows.moved[:, row])
    return (
        f"{rows.at(row)} moves {way:.1f} m in {rows.dt:g} s, at {rows.of('speed')[row]:.1f} m/s with the heading "
        f"{rows.of('heading')[row]:.2f} rad; expected positions without jumps: give it another number after the jump"
    )


def _drift(rows: Rows) -> str | None:
    heading = rows.of("heading")
    wrong = rows.off_course(heading)
    if not wrong.any():
        return None
    track = int(wrong.argmax())
    moved, expected = (rows.by_track(steps)[:, track] for steps in (rows.moved, rows.expected(heading)))
    found = (
        f"{rows.at(int(rows.starts[track]))} moves ({moved[0]:.1f}, {moved[1]:.1f}) m along and across the road until "
        f"its track ends; speeds and headings give ({expected[0]:.1f}, {expected[1]:.1f}) m"
    )
    likely = (
        (np.pi / 2 - heading, "they count from the road's direction, not from north"),
        (-heading, "they must grow to the left"),
        (np.radians(heading), "multiply degrees by π/180"),
        (heading + np.pi, "or lon runs against the direction of travel: turn the road round"),
    )
    for other, hint in likely:
        if not rows.off_course(other)[wrong].any():
            return f"{found}; check the headings: {hint}"
    return f"{found}; check the units of positions, speeds and headings (m, m/s, rad)"


def _motion(rows: Rows) -> str | None:
    """What is wrong with single steps first, unless so many are wrong that whole tracks are."""
    first, second = (_jumps, _drift) if rows.jumps.sum() <= SYSTEMATIC * len(rows.jumps) else (_drift, _jumps)
    return first(rows) or second(rows)


def _against(rows: Rows) -> str | None:
    if not rows.backwards.any():
        return None
    track = int(rows.backwards.argmax())
    back = -rows.by_track(rows.moved[0])[track]
    return (
        f"{rows.at(int(rows.starts[track]))} drives {back:.0f} m against the direction of the road; expected one "
        "carriageway along growing lon: leave the vehicle out, or turn lon and lat round"
    )


def _beside(rows: Rows) -> str | None:
    edges = np.asarray(rows.road.edges)
    limits = {
        "lat": (edges[0] - BESIDE, edges[-1] + BESIDE, "lat is 0 at the right edge and grows to the left"),
        "lon": (-BEYOND, float(rows.road.length) + BEYOND, "give the road its length, or shift lon"),
    }
    for name, (least, most, hint) in limits.items():
        wrong = (rows.of(name) < least) | (rows.of(name) > most)
        if wrong.any():
            row = int(wrong.argmax())
            found = f"{rows.at(row)} is off the road, {name} = {rows.of(name)[row]:.6g} m"
            return f"{found}; expected {least:g} to {most:g} m: {hint}"
    return None


CHECKS: tuple[Callable[[Rows], str | None], ...] = (
    _time_step, _road, _some, _finite, _numbers, _order, _sizes, _turned,
    _units, _fast, _motion, _against, _beside,
)  # fmt: skip
"""In this order, as each relies on those before"""
