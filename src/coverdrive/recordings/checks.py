"""What every recording must be, checked whenever one is made: the right units, regular tracks, vehicles on the road.

The limits are those of road traffic, wide enough for trucks, motorcycles and measurement noise, and narrow enough to
tell metres from feet, seconds from milliseconds and m/s from km/h. A *track* is a vehicle without a break in time; R is
the number of rows, steps lead from one to the next.
"""

from collections.abc import Iterator
from functools import cached_property
from itertools import chain

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int, Num

from coverdrive.errors import DataError
from coverdrive.percentages import percent
from coverdrive.road import NARROWEST, LaneEdges, Road, lanes_there

TIME_STEPS = (0.02, 1.0)
"""[s] between two rows of a vehicle: cameras and drones give 10 to 30 Hz; at less than 1 Hz a lane change is a few
points"""

LARGEST, LARGEST_WHOLE = 2.0**53, 2.0**62
"""Float64 does not tell whole numbers from here on apart; nothing that is measured on a road is as large. Of those that
are stored as whole numbers, the first that is refused, so that there are others for tracks that are split"""

LATEST = 1e10
"""[s] POSIX times are below 2e9 s, the same in milliseconds above 1e12"""

LENGTHS, WIDTHS = (1.0, 60.0), (0.4, 4.0)
"""[m] motorcycles of NGSIM to Australian road trains (53.5 m); handlebars to vehicles of excess width"""

USUAL_SIZES = {"length": (2.5, 20.0), "width": (1.0, 3.0)}
"""[m] of the median vehicle: smaller are motorcycles, and cars in another unit"""

LANE_WIDTHS = (2.0, 7.5)
"""[m] lanes are 2.7 to 3.6 m wide on roads (AASHTO Green Book), narrower in road works, wider on ramps"""

WIDEST_PLACE, CROSSED = 15.0, 1e-3
"""[m] a lane is at most where it splits, or another one joins it; and edges that coincide cross by less"""

LONGEST_ROAD = 200_000.0
"""[m]"""

FASTEST = 90.0
"""[m/s] 324 km/h"""

BESIDE, BEYOND = 5.0, 200.0
"""[m] vehicles may be this far beside the outer edges (a hard shoulder), and beyond the ends of the road"""

MOST_IMPLAUSIBLE = 0.2
"""Share of the vehicles that may be left out, or not be believed, because of their motion"""

SYSTEMATIC = 0.1
"""Share of the steps that jump from which on headings are wrong, and not positions"""

SPEED_UNITS = {"km/h": 1 / 3.6, "mph": 0.44704, "ft/s": 0.3048}
"""[m/s] of the units in which speeds are stated by mistake"""

LEAST_DRIFT, DRIFT = 3.0, 0.1
"""[m] and share of a track's way by which its speeds and headings may miss its end; recorded US-101 traffic stays
within 1.5 m"""

LEAST_JUMP, JUMP = 3.0, 0.3
"""[m] and share of its way by which a step may differ from the speeds at its ends; US-101: 1.2 m in 0.1 s"""

ACROSS, MOVING = np.pi / 3, 5.0
"""[rad] to the road and [m/s]: who drives so does not follow it, but crosses it"""

SAME_PLACE = 0.5
"""[m] no two vehicles have their centres within a square of this side"""

BACKWARDS = 5.0
"""[m] that a track may go back: noise of vehicles that stand still"""

WITHIN = 0.25
"""Share of the shorter length and of the narrower width by which two vehicles overlap that lie within each other"""

MOST_WITHIN = 0.2
"""Share of those with another vehicle beside them that may lie within one: in recorded traffic (US-101, MONA) it is up
to 0.08, in the same with feet taken for metres 0.3 to 0.8"""

ENOUGH = 5
"""Vehicles from which on shares and medians tell something"""

COMPARED, NEIGHBOURS = 50_000, 20
"""Rows of a long recording in which vehicles beside each other are looked for, and how many next ones of each"""


class Rows:
    """The columns of a recording's table as arrays, and what moves between successive rows."""

    def __init__(self, table: pl.DataFrame, dt: float, road: Road):
        self.table, self.dt, self.road = table, dt, road

    def of(self, name: str) -> Num[np.ndarray, " R"]:
        """One column."""
        return self.table[name].to_numpy()

    def at(self, row: np.intp) -> str:
        """Vehicle and time of a row, for messages."""
        return f"vehicle {self.of('vehicle')[row]} at {self.of('time')[row]:.6g} s"

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
        lon, lat = self.of("lon"), self.of("lat")
        stretch = self.road.stretch(lon, lat)
        along = np.diff(lon) * (stretch[1:] + stretch[:-1]) / 2
        return np.stack([along, np.diff(lat)]) * self.goes_on

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

    @cached_property
    def doubled(self) -> Int[np.ndarray, " vehicles"]:
        """Numbers of vehicles that are in the place of one of a smaller number, most of the time."""
        place = [(pl.col(name) / SAME_PLACE).round().alias(name) for name in ("lon", "lat")]
        cells = self.table.select("vehicle", *place, moment=self.moment)
        first = pl.col("vehicle").min().over("moment", "lon", "lat")
        share = cells.select("vehicle", again=pl.col("vehicle") > first).group_by("vehicle").agg(pl.col("again").mean())
        return share.filter(pl.col("again") > 0.5)["vehicle"].sort().to_numpy()

    @cached_property
    def beside(self) -> Int[np.ndarray, "2 pairs"]:
        """Pairs of rows of one moment whose vehicles overlap along the road, in whatever lanes.

        Where there are many rows, they are those of some moments.
        """
        lon, length = self.of("lon"), self.of("length")
        order = np.lexsort((lon, self.moment, self.of("group")))
        order = order[self.moment[order] % -(-len(order) // COMPARED) == 0]
        pairs = [np.zeros((2, 0), dtype=np.int64)]
        for step in range(1, NEIGHBOURS):
            one, next = order[:-step], order[step:]
            together = (self.moment[one] == self.moment[next]) & (self.of("group")[one] == self.of("group")[next])
            close = together & (lon[next] - lon[one] < _touching(length[one], length[next]))
            if not close.any():
                break
            pairs.append(np.stack([one[close], next[close]]))
        return np.concatenate(pairs, axis=1)

    @cached_property
    def across(self) -> Bool[np.ndarray, " R"]:
        """Rows of vehicles that cross the road, or drive against its direction."""
        return (np.abs(self.of("heading")) > ACROSS) & (self.of("speed") > MOVING)


def _touching(one: Float[np.ndarray, " N"], other: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """[m] between the centres of vehicles of these lengths or widths that just lie within each other."""
    return (one + other) / 2 - WITHIN * np.minimum(one, other)


def check(table: pl.DataFrame, dt: float, road: Road) -> None:
    """Refuse a table that cannot be traffic on this road: a `DataError` names the first row that is wrong."""
    rows = Rows(table, dt, road)
    for problem in chain.from_iterable(problems(rows) for problems in CHECKS):
        raise DataError(problem)


def implausible_vehicles(table: pl.DataFrame, dt: float, road: Road) -> Int[np.ndarray, " vehicles"]:
    """Numbers of the vehicles that jump, drift, speed, cross the road or drive backwards as none on it does."""
    rows = Rows(table, dt, road)
    vehicle, tracks = rows.of("vehicle"), rows.backwards | rows.off_course(rows.of("heading"))
    wrong = (rows.of("speed") > FASTEST) | rows.across
    return np.unique(np.concatenate([vehicle[rows.starts[tracks]], vehicle[:-1][rows.jumps], vehicle[wrong]]))


def check_vehicles(table: pl.DataFrame, dt: float, road: Road) -> None:
    """Refuse vehicles on a road that cannot be traffic by their sizes, their speeds, or as many jump or drift.

    As `check`, but they may drive in any direction, cross the road or overlap, and a few may move as none does. Where
    there are few, all may be motorcycles, or trucks.
    """
    rows, vehicles = Rows(table, dt, road), table["vehicle"].n_unique()
    vehicle, drift = rows.of("vehicle"), rows.off_course(rows.of("heading"))
    looked_at = [_measures, _speeds]
    if vehicles >= ENOUGH:
        looked_at.insert(0, _usual)
    if len(np.union1d(vehicle[:-1][rows.jumps], vehicle[rows.starts[drift]])) > MOST_IMPLAUSIBLE * vehicles:
        looked_at.append(_motion)
    for problem in chain.from_iterable(problems(rows) for problems in looked_at):
        raise DataError(problem)


def wrong_time_step(what: str, dt: float) -> Iterator[str]:
    """That no recording of traffic has such a time between two rows [s]."""
    least, most = TIME_STEPS
    if not least <= dt <= most:
        hint = "check the unit of the times"
        if least / 10 < dt < least:
            hint = f"keep one in {np.ceil(least / dt):g} of the rows of each vehicle, or {hint}"
        if dt > most:
            few = f"at {1 / dt:.3g} Hz a lane change is too few points"
            hint = f"{few}, take a recording of {1 / most:g} Hz or more, or {hint}"
        yield f"{what} is {dt:g} s; expected {least} to {most:g} s ({1 / least:g} to {1 / most:g} Hz): {hint}"


def wrong_usual_sizes(length: Float[np.ndarray, " R"], width: Float[np.ndarray, " R"]) -> Iterator[tuple[str, str]]:
    """That sizes [m] are not those of most vehicles: the column that is wrong, and why."""
    long, wide = float(np.median(length)), float(np.median(width))
    if wide > max(long, USUAL_SIZES["length"][0]):
        found = f"most vehicles are wider than long, {wide:g} m and {long:g} m in the median"
        yield "width", f"{found}; expected length along the heading: swap the columns length and width"
    for name, usual in (("length", long), ("width", wide)):
        least, most = USUAL_SIZES[name]
        if not least <= usual <= most:
            found = f"the median {name} of the vehicles is {usual:.3g} m; expected {least:g} to {most:g} m"
            other = "metres that are taken for feet" if usual < least else "feet that are taken for metres"
            yield name, f"{found}: check the unit, {other} are {0.3048 if usual < least else 3.28:g} times as long"


def wrong_speed_limit(limit: float | None) -> Iterator[str]:
    """That no road has such a limit [m/s]."""
    if limit is not None and not 0 < limit <= FASTEST:
        hint = "divide km/h by 3.6" if limit > 0 else "leave it out if there is none"
        yield f"the speed limit is {limit:g} m/s; expected more than 0 and up to {FASTEST:g} m/s: {hint}"


def _road(rows: Rows) -> Iterator[str]:
    yield from wrong_time_step("the time step", rows.dt)
    edges = np.asarray(rows.road.edges, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or not np.isfinite(edges).all() or np.any(np.diff(edges) <= 0):
        yield f"the lane edges are {edges.tolist()}; expected two or more, ascending from the right edge of the road"
    if abs(edges[0]) > 0.01:
        yield f"the right edge of the road is at lat = {edges[0]:g} m; expected 0: subtract it from edges and lat"
    for lane, width in enumerate(np.diff(edges)):
        yield from _width(f"lane {lane}", width)
    if rows.road.changing is not None:
        yield from _changing(rows.road.changing, len(edges))
    yield from wrong_speed_limit(rows.road.speed_limit)
    if not 0 < float(rows.road.length) <= LONGEST_ROAD:
        yield f"the road is {float(rows.road.length):g} m long; expected more than 0 and up to {LONGEST_ROAD:g} m"


def _width(lane: str, width: float) -> Iterator[str]:
    if not LANE_WIDTHS[0] <= width <= LANE_WIDTHS[1]:
        hint = "; are these feet? multiply by 0.3048" if 8 <= width <= 25 else "; check the unit of the edges"
        yield f"{lane} is {width:g} m wide; expected {LANE_WIDTHS[0]:g} to {LANE_WIDTHS[1]:g} m{hint}"


def _changing(changing: LaneEdges, edges: int) -> Iterator[str]:
    """Lane edges that change along the road."""
    lon, lat = (np.asarray(values, dtype=np.float64) for values in (changing.lon, changing.lat))
    what = "the lane edges that change along the road"
    if lon.ndim != 1 or len(lon) == 0 or lat.shape != (len(lon), edges):
        found = f"{what} have positions of shape {lon.shape} and lat of shape {lat.shape}"
        yield f"{found}; expected (P,) and (P, {edges}), as the road has {edges} edges: give each at every position"
    for row in np.flatnonzero(~np.isfinite(lon) | ~np.isfinite(lat).all(axis=1)):
        found = f"{what} are {lat[row].tolist()} at lon = {lon[row]:g} m, number {row}"
        yield f"{found}; expected numbers: let two edges coincide where there is no lane between them"
    for row in np.flatnonzero(np.abs(lon) > LONGEST_ROAD):
        found = f"{what} are given at lon = {lon[row]:g} m"
        yield f"{found}; expected −{LONGEST_ROAD:g} to {LONGEST_ROAD:g} m: check the unit, and count from its beginning"
    for row in np.flatnonzero(np.diff(lon) <= 0):
        found = f"{what} are given at lon = {lon[row]:g} m and then at {lon[row + 1]:g} m"
        yield f"{found}; expected ascending positions: sort them, and give each once"
    widths, there = np.diff(lat, axis=1), lanes_there(lat)
    for row, lane in np.argwhere(widths < -CROSSED):
        found = f"the edges of lane {lane} cross at lon = {lon[row]:g} m, the left one at {lat[row, lane + 1]:g} m"
        expected = f"expected it at {lat[row, lane]:g} m or farther to the left"
        yield f"{found}; {expected}: sort the edges from right to left, and let them coincide where there is no lane"
    for lane, (width, own) in enumerate(zip(widths.T, there.T, strict=True)):
        if not own.any():
            found = f"lane {lane} is nowhere there, up to {width.max():g} m wide"
            yield f"{found}; expected {NARROWEST:g} m or more somewhere: leave it out, or check the unit of the edges"
        yield from _width(f"lane {lane}, where it is there,", float(np.median(width[own])))
        if width.max() > WIDEST_PLACE:
            found = f"lane {lane} is {width.max():g} m wide at lon = {lon[width.argmax()]:g} m"
            yield f"{found}; expected up to {WIDEST_PLACE:g} m: check the edges there"


def _cells(rows: Rows) -> Iterator[str]:
    if rows.table.is_empty():
        yield "the table holds no rows; expected at least one vehicle"
    for name, column in zip(rows.table.columns, rows.table, strict=True):
        for row in (~column.is_finite()).fill_null(True).arg_true() if name != "stated" else ():
            yield (
                f"{name} of vehicle {rows.table['vehicle'][row]} in row {row} is {column[row]}; expected a number: "
                "remove the row, and give what comes after the gap another vehicle number"
            )
    lowest = rows.of("vehicle").min()
    if lowest < 0:
        yield f"a vehicle has the number {lowest}; expected 0 or more: number the vehicles anew"


def _order(rows: Rows) -> Iterator[str]:
    time = rows.of("time")
    for row in np.flatnonzero(np.abs(time) > LATEST):
        yield f"{rows.at(row)}: expected seconds; divide milliseconds by 1000"
    step = np.diff(rows.moment)
    for row in np.flatnonzero((np.diff(rows.of("vehicle")) < 0) | (rows.same & (np.diff(time) < 0))):
        yield f"{rows.at(row + 1)} comes after {rows.at(row)}; expected rows in order: sort by vehicle and time"
    for row in np.flatnonzero(np.abs(time / rows.dt - rows.moment) > 0.01):
        found = f"{rows.at(row)} is between two time steps"
        yield f"{found}; expected multiples of dt = {rows.dt:g} s: resample the tracks"
    for row in np.flatnonzero(rows.same & (step == 0)):
        yield f"{rows.at(row)} has two rows; expected one: remove the other"
    for row in np.flatnonzero(rows.same & (step > 1) & (np.diff(rows.of("group")) == 0)):
        yield (
            f"{rows.at(row)} is next seen at {time[row + 1]:.6g} s; expected a row every {rows.dt:g} s: fill the gap, "
            "or give the vehicle another number after it"
        )


def _usual(rows: Rows) -> Iterator[str]:
    for _, problem in wrong_usual_sizes(rows.of("length"), rows.of("width")):
        yield problem


def _measures(rows: Rows) -> Iterator[str]:
    """Sizes and headings."""
    for name, (least, most) in {"length": LENGTHS, "width": WIDTHS}.items():
        values = rows.of(name)
        for row in np.flatnonzero((values < least) | (values > most)):
            yield f"the {name} of {rows.at(row)} is {values[row]:g} m; expected {least:g} to {most:g} m"
    heading = rows.of("heading")
    for row in np.flatnonzero(np.abs(heading) > np.pi + 1e-6):
        found = f"the heading of {rows.at(row)} is {heading[row]:g} rad"
        yield f"{found}; expected −π to π: multiply degrees by π/180"


def _speeds(rows: Rows) -> Iterator[str]:
    """Speeds against positions, over all vehicles: the ratio tells the unit."""
    stated, seen = float(np.sum(rows.way)), float(np.sum(np.hypot(*rows.by_track(rows.moved))))
    if abs(stated - seen) > 0.2 * max(stated, seen) + LEAST_DRIFT * len(rows.starts):
        ratio = seen / stated if stated > 0 else np.inf
        found = f"vehicles move {ratio:.3g} times as far as their speeds say ({seen:.0f} m instead of {stated:.0f} m)"
        for name, unit in SPEED_UNITS.items():
            if abs(ratio / unit - 1) < 0.05:
                yield f"{found}; the speeds look like {name}: multiply them by {unit:.4g}"
        if abs(ratio * 0.3048 - 1) < 0.05:
            yield f"{found}; the positions look like feet: multiply lon, lat and sizes by 0.3048"
        yield f"{found}; expected the same: check that lon and lat are in m, speeds in m/s and dt = {rows.dt:g} in s"
    speed = rows.of("speed")
    for row in np.flatnonzero((speed < 0) | (speed > FASTEST)):
        yield f"the speed of {rows.at(row)} is {speed[row]:g} m/s; expected 0 to {FASTEST:g} m/s along its heading"


def _jumps(rows: Rows) -> Iterator[str]:
    for row in np.flatnonzero(rows.jumps):
        yield (
            f"{rows.at(row)} moves {np.hypot(*rows.moved[:, row]):.1f} m in {rows.dt:g} s, at "
            f"{rows.of('speed')[row]:.1f} m/s with the heading {rows.of('heading')[row]:.2f} rad; expected positions "
            "without jumps: give it another number after the jump"
        )


def _drift(rows: Rows) -> Iterator[str]:
    heading = rows.of("heading")
    wrong = rows.off_course(heading)
    for track in np.flatnonzero(wrong):
        moved, expected = (rows.by_track(steps)[:, track] for steps in (rows.moved, rows.expected(heading)))
        found = (
            f"{rows.at(rows.starts[track])} moves ({moved[0]:.1f}, {moved[1]:.1f}) m along and across the road until "
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
                yield f"{found}; check the headings: {hint}"
        yield f"{found}; check the units of positions, speeds and headings (m, m/s, rad)"


def _motion(rows: Rows) -> Iterator[str]:
    """What is wrong with single steps first, unless so many are wrong that whole tracks are."""
    kinds = (_jumps, _drift) if rows.jumps.sum() <= SYSTEMATIC * len(rows.jumps) else (_drift, _jumps)
    for kind in kinds:
        yield from kind(rows)


def _place(rows: Rows) -> Iterator[str]:
    for track in np.flatnonzero(rows.backwards):
        yield (
            f"{rows.at(rows.starts[track])} drives {-rows.by_track(rows.moved[0])[track]:.0f} m against the direction "
            "of the road; expected one carriageway along growing lon: leave the vehicle out, or turn lon and lat round"
        )
    for row in np.flatnonzero(rows.across):
        yield (
            f"{rows.at(row)} drives across the road, with the heading {rows.of('heading')[row]:.2f} rad; expected "
            "vehicles that follow it: choose a road without crossings"
        )
    edges = rows.road.edges_at(rows.of("lon"))
    right, left = edges[:, 0].min() - BESIDE, edges[:, -1].max() + BESIDE
    limits = {
        "lat": (right, left, "lat is 0 at the right edge and grows to the left"),
        "lon": (-BEYOND, float(rows.road.length) + BEYOND, "give the road its length, or shift lon"),
    }
    for name, (least, most, hint) in limits.items():
        values = rows.of(name)
        for row in np.flatnonzero((values < least) | (values > most)):
            found = f"{rows.at(row)} is off the road, {name} = {values[row]:.6g} m"
            yield f"{found}; expected {least:g} to {most:g} m: {hint}"


def _doubled(rows: Rows) -> Iterator[str]:
    for vehicle in rows.doubled:
        found = f"vehicle {vehicle} is where another one is, most of the time"
        yield f"{found}; expected every vehicle once: leave one of them out"


def _within(rows: Rows) -> Iterator[str]:
    """Vehicles within others, as where positions and sizes are in different units."""
    lat, width, vehicle = rows.of("lat"), rows.of("width"), rows.of("vehicle")
    one, other = rows.beside
    inside = rows.beside[:, np.abs(lat[one] - lat[other]) < _touching(width[one], width[other])]
    share = len(np.unique(inside)) / max(1, len(np.unique(rows.beside)))
    if share > MOST_WITHIN and len(np.unique(vehicle[inside])) >= ENOUGH:
        first, second = inside[:, 0]
        yield (
            f"{rows.at(first)} lies within vehicle {vehicle[second]}, and so do {percent(share, 2)} of those that have "
            "another one beside them; expected vehicles apart: check that positions, lengths and widths are in one "
            "unit, as feet or metres"
        )


CHECKS = (_road, _cells, _order, _usual, _measures, _speeds, _motion, _place, _doubled, _within)
"""In this order, as each relies on what those before have found right; each says what is wrong, the first row first"""
