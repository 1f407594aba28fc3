"""Tracks in map coordinates, as most readers yield them, become recordings: one for each direction of travel.

Directions, lanes and the road's line are found here, for all formats alike (`coverdrive.recordings.roads.carriageway`,
`coverdrive.recordings.roads.lanes`).
"""

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import polars as pl
from jaxtyping import Float

from coverdrive.errors import NoVehiclesError, RecordingError
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.files.columns import LENGTH, WIDTH, plausible_rows
from coverdrive.recordings.files.delimited import ROW
from coverdrive.recordings.files.lanelet2 import Origin, read_lanelet2
from coverdrive.recordings.files.times import MOST_UNEVEN, moments_of, time_step
from coverdrive.recordings.roads.carriageway import Line, centred, check_apart, line_along, rows_of, split_directions
from coverdrive.recordings.roads.driven_road import driven_road, roads_of
from coverdrive.recordings.roads.lanes import edges_from_centres, edges_from_lanes, edges_from_tracks, order_of
from coverdrive.recordings.roads.partial_lanes import with_partial_lanes
from coverdrive.recordings.tracks.reading import Reading, check_time_step, make_reading
from coverdrive.recordings.tracks.repair import RawTracks, tidy
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road

NEEDED = ("vehicle", "time", "x", "y")
"""Columns of a table of tracks that there have to be"""

CENTRINGS = 2
"""How often a line that was found by the tracks is put in the middle of the lanes that it gives"""

BESIDE_LINES = 3.0
"""[m] from the median vehicle's way to the nearest known line of its carriageway, at most"""

PAUSE, ELSEWHERE = 60.0, 5.0
"""[s] after which a number is that of another vehicle, and [m] between two places that are not the same"""

APART, MOST_REPEATED = 0.01, 0.1
"""[m] between two rows of a vehicle and moment that are not the same, and the share of all rows that may be such"""

STEPS, LONGEST_STEPS, OPPOSED = 10, 1.0, -0.5
"""Rows and [s] at most over which motion and stated velocity are compared, and the share of agreement below which they
are opposed"""

SHORTEST_WAY, MOST_TURNED = 1.0, 30.0
"""[m] that a vehicle moves for its heading to be compared with its motion, and [degrees] between them in most rows"""


@dataclass(frozen=True, eq=False)
class MapTracks:
    """Vehicles seen from above, in a right-handed frame (x to the east, y to the north, or both turned alike)."""

    name: str
    """of the recording"""
    table: pl.DataFrame
    """columns vehicle, time [s], x and y [m] of the centre; if known length and width [m], speed [m/s], or vx and vy
    [m/s] of which it is made, heading [rad] counter-clockwise from x, lane (a number, the same along a lane), kind
    (index in `KINDS`), row (of the file)"""
    markings: tuple[Line, ...] = ()
    """lines between lanes and beside the outermost ones, if known"""
    centres: tuple[Line, ...] = ()
    """lines in the middle of lanes, if known"""
    line: Line | None = None
    """along the road, where neither of these is known"""
    origin: Origin | None = None
    """of x and y in UTM coordinates, if known"""
    dt: float | None = None
    """[s] between two rows of a vehicle, if known"""
    side: Literal["right", "left"] | None = None
    """of the road on which one drives there, if known"""
    repairs: Counter[str] = field(default_factory=Counter[str])
    """how often each kind of repair was made so far"""


def readings_from_map(
    file: Path, tracks: MapTracks, settings: SmoothingSettings, map: Path | None = None
) -> tuple[Reading, ...]:
    """One recording for each direction of travel, on the roads of a Lanelet2 map if there is one.

    Raises:
        RecordingError, DataError: the tracks cannot be traffic on one straight road, with the reason.
    """
    repairs = Counter(tracks.repairs)
    roads = [] if map is None else _mapped(file, tracks, map)
    table, dt = _regular(file, tracks, repairs)
    known = (*tracks.markings, *tracks.centres) or (() if tracks.line is None else (tracks.line,))
    places, lines = _along(table, roads) if roads else (table, known)
    sides = [rows_of(table, vehicles) for vehicles in split_directions(file, places, repairs, lines)]
    found = [(*_driven(side, roads), "map") if roads else _on_road(file, side, tracks, known) for side in sides]
    notes: dict[str, str] = {}
    if len(sides) == 2:
        way = check_apart(file, found[0][1], sides[1])
        if tracks.side not in (None, way):
            problem = f"vehicles keep {way} of those that come towards them; expected them to keep {tracks.side}"
            raise RecordingError(file, f"{problem}: positions are mirrored, turn the y round")
        found = [(raw, replace(road, side=way), lanes) for raw, road, lanes in found]
        notes["traffic"] = f"keeps {way}"
    names = [tracks.name] if len(sides) == 1 else [f"{tracks.name} {_towards(side)}" for side in sides]
    return tuple(
        make_reading(file, name, tidy(raw, dt, own), dt, road, settings, own, {"lanes": lanes} | notes)
        for name, (raw, road, lanes), own in zip(names, found, (repairs, Counter[str]()), strict=False)
    )


def _regular(file: Path, tracks: MapTracks, repairs: Counter[str]) -> tuple[pl.DataFrame, float]:
    """The table with every column that is optional, sorted, its times as ``moment`` in units of the time step [s].

    ``repairs`` gains ``assumed sizes``, ``rows out of order``, and what `plausible_rows` and `_numbered_anew` repair.
    """
    table = tracks.table
    if not isinstance(table, pl.DataFrame):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RecordingError(file, f"the reader gave a table of {type(table).__module__}; expected a polars DataFrame")
    for name in NEEDED:
        if name not in table.columns:
            raise RecordingError(file, f"the reader gave no column {name}; expected {', '.join(NEEDED)}")
    if table.is_empty():
        others = tracks.repairs["rows of other road users"]
        raise NoVehiclesError(file, f"it holds no vehicles, and {others} rows of other road users; choose another file")
    usual = {"length": pl.lit(LENGTH), "width": pl.lit(WIDTH), "kind": pl.lit(0, pl.Int8)}
    if "length" not in table.columns or "width" not in table.columns:
        repairs["assumed sizes"] += table["vehicle"].n_unique()
    if "vx" in table.columns:
        usual["speed"] = (pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt()
    if ROW not in table.columns:
        table = table.with_row_index(ROW, 1)
    for name in NEEDED:
        for row in (~table[name].cast(pl.Float64, strict=False).is_finite().fill_null(False)).arg_true():
            problem = f"the reader gave {table[name][row]!r}; expected numbers, for vehicles as well"
            raise RecordingError(file, f"{problem}: leave out what is not known", table[ROW][row], name)
    table = table.with_columns(**{name: value for name, value in usual.items() if name not in table.columns})
    table = plausible_rows(file, table.rename({"time": "clock"}), repairs)
    if tracks.dt is not None:
        check_time_step(file, tracks.dt, "the time between two frames")
    dt = tracks.dt or time_step(file, table, "times are in seconds")
    moment = moments_of(file, table["clock"].to_numpy(), dt)
    table = table.with_columns(pl.col("vehicle").cast(pl.Int64), moment=moment)
    backwards = table.select(pl.col("moment").diff().over("vehicle") < 0)["moment"]
    repairs["rows out of order"] += int(backwards.sum())
    table = _numbered_anew(file, table.sort("vehicle", "moment", maintain_order=True), round(PAUSE / dt), repairs)
    _check_directions(file, table, dt)
    if "speed" not in table.columns:
        way = (pl.col("x").diff() ** 2 + pl.col("y").diff() ** 2).sqrt() / (pl.col("moment").diff() * dt)
        table = table.with_columns(speed=way.fill_null(strategy="backward").over("vehicle").fill_null(0.0))
    return table, dt


def _numbered_anew(file: Path, table: pl.DataFrame, pause: int, repairs: Counter[str]) -> pl.DataFrame:
    """Vehicles that come back after so many moments get another number, as where runs follow one another.

    Refused are numbers that repeat at the same time, and times that repeat while vehicles move. ``repairs`` gains
    ``split tracks``.
    """
    steps = table.select(pl.col("moment", "x", "y").diff().over("vehicle"))
    away = (steps["x"] ** 2 + steps["y"] ** 2).sqrt() * (steps["moment"] == 0)
    twice, moved = away > ELSEWHERE, away > APART
    if twice.sum() > MOST_UNEVEN * len(table):
        row = int(twice.arg_max() or 0)
        found = f"the number {table['vehicle'][row]} of a vehicle is at two places at {table['clock'][row]:g} s"
        hint = "number the vehicles of different runs apart, or give each run a file of its own"
        raise RecordingError(file, f"{found}, and so are others; expected each once: {hint}", table[ROW][row])
    if moved.sum() > MOST_REPEATED * len(table):
        row = int(moved.arg_max() or 0)
        found = f"vehicle {table['vehicle'][row]} is at two places at {table['clock'][row]:g} s, and so are others"
        hint = "give times to the millisecond, as where they are rounded to less than there are frames"
        raise RecordingError(file, f"{found}; expected a time for each row of a vehicle: {hint}", table[ROW][row])
    back = (steps["moment"] > pause).fill_null(False)
    if not back.any():
        return table
    repairs["split tracks"] += int(back.sum())
    part = pl.struct("vehicle", pl.Series("part", back.cum_sum()))
    return table.with_columns(vehicle=part.rank("dense").cast(pl.Int64))


def _check_directions(file: Path, table: pl.DataFrame, dt: float) -> None:
    """Refuse positions that run against the velocities that the file states, as those in images do."""
    steps = min(STEPS, max(1, round(LONGEST_STEPS / dt)))
    ahead = (pl.col("x", "y").shift(-steps) - pl.col("x", "y")).over("vehicle")
    moved = table.with_columns(ahead.name.suffix("_moved")).drop_nulls()
    for axis in "xy" if "vx" in table.columns else "":
        product = (moved[f"{axis}_moved"] * moved[f"v{axis}"]).to_numpy()
        if product.sum() < OPPOSED * np.abs(product).sum():
            problem = f"positions along {axis} run against the velocities that the file states"
            raise RecordingError(file, f"{problem}; expected one frame for both: turn the {axis} of one of them round")
    if "heading" in table.columns:
        east, north = moved.select("x_moved", "y_moved").to_numpy().T
        turned = np.angle(np.exp(1j * (np.arctan2(north, east) - moved["heading"].to_numpy())))
        turned = np.degrees(np.abs(turned[np.hypot(east, north) > SHORTEST_WAY]))
        if len(turned) and np.median(turned) > MOST_TURNED:
            found = f"vehicles move at {np.median(turned):.0f}° to their headings in most rows"
            raise RecordingError(file, f"{found}; expected headings counter-clockwise from x, in a frame whose y is up")


def _towards(side: pl.DataFrame) -> str:
    """The direction of travel in words of the map."""
    ends = side.group_by("vehicle").agg(pl.col("x", "y").last() - pl.col("x", "y").first())
    x, y = ends.select("x", "y").sum().to_numpy()[0]
    return ("towards +x" if x > 0 else "towards -x") if abs(x) >= abs(y) else ("towards +y" if y > 0 else "towards -y")


def _mapped(file: Path, tracks: MapTracks, map: Path) -> list[Road]:
    """The roads of the carriageways of a map."""
    if tracks.origin is None:
        raise RecordingError(file, "where its tracks are on a map is not known; leave the map out")
    with naming(map, "the map"):
        roads = list(roads_of(read_lanelet2(map, tracks.origin), []))
    if not roads:
        raise RecordingError(map, "the map has no road whose curves are wide enough; choose another one")
    return roads


def _along(table: pl.DataFrame, roads: list[Road]) -> tuple[pl.DataFrame, tuple[Line, ...]]:
    """The rows with x and y [m] along and across the road that is driven on, and the line along that."""
    raw, road = _driven(table, roads)
    return table.with_columns(x=raw.lon, y=raw.lat), (np.array([[0.0, 0.0], [float(road.length), 0.0]]),)


def _driven(table: pl.DataFrame, roads: list[Road]) -> tuple[RawTracks, Road]:
    """The rows in the frame of the road on which they are driven, and that road."""
    found = driven_road(roads, table)
    assert found is not None  # there are roads
    return found[1], found[0]


def _on_road(file: Path, side: pl.DataFrame, tracks: MapTracks, known: tuple[Line, ...]) -> tuple[RawTracks, Road, str]:
    """The rows of one direction in the frame of their road, the road, and where its lanes are from."""
    line = line_along(file, side, known)
    lon, lat = line.to_road(side["x"], side["y"])
    edges, lanes = _edges(file, side, lat, tracks, line)
    for _ in range(CENTRINGS if not known else 0):
        centres = (edges[1:] + edges[:-1]) / 2
        line = centred(line, lon, lat - centres[np.searchsorted(edges[1:-1], lat)])
        lon, lat = line.to_road(side["x"], side["y"])
        edges, lanes = _edges(file, side, lat, tracks, line)
    raw = RawTracks.placed(side, lon, lat)
    found = with_partial_lanes([raw], edges)
    road = Road(found.edges, line.length, replace(line, lat=-found.right), found.changing)
    return replace(raw, lat=lat - found.right), road, lanes + found.told


def _edges(
    file: Path, side: pl.DataFrame, lat: Float[np.ndarray, " R"], tracks: MapTracks, line: ReferenceLine
) -> tuple[Float[np.ndarray, " edges"], str]:
    """Lane edges [m] to the left of the line, ascending, and what they are from."""
    bounds = np.quantile(lat, (0.02, 0.98))
    markings, centres = (_offsets(lines, line) for lines in (tracks.markings, tracks.centres))
    if len(markings) > 1:
        return markings, "markings"
    inside = centres[(centres > bounds[0] - BESIDE_LINES) & (centres < bounds[1] + BESIDE_LINES)]
    if len(inside):
        return edges_from_centres(inside), "centre lines"
    named = "lane" in side.columns
    edges = edges_from_lanes(lat, side["lane"].to_numpy()) if named else edges_from_tracks(lat)
    if edges is None:
        problem = f"the lanes cannot be told; vehicles drive between {bounds[0]:.1f} and {bounds[1]:.1f} m beside the"
        raise RecordingError(file, f"{problem} line of the road; expected a few lanes that most vehicles are in")
    if not named:
        return edges, "estimated (tracks)"
    orders = {0: "in no order", 1: "growing to the left", -1: "growing to the right"}
    return edges, f"lane numbers, {orders[order_of(side['lane'].to_numpy(), lat)]}"


def _offsets(lines: tuple[Line, ...], line: ReferenceLine) -> Float[np.ndarray, " L"]:
    """Median distance [m] of each of some lines to the left of the road's line, ascending."""
    return np.sort([float(np.median(line.to_road(*each.T)[1])) for each in lines])
