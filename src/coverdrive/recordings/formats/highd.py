"""Road users seen from a drone, in metres: highD (Krajewski et al. 2018) and AD4CHE, which has its layout, on straight
motorways; exiD, inD, rounD and uniD (Moers et al. 2022, Bock et al. 2020) on any road.

``NN_tracks.csv`` comes with ``NN_tracksMeta.csv`` (class, and in highD carriageway, of every vehicle) and
``NN_recordingMeta.csv`` (frame rate, and in highD lane markings). Positions in highD are those of the upper left corner
of a box along the image, whose y grows downward; ``width`` is its size along the road, that is the vehicle's length;
each carriageway becomes a recording. In the others they are centres, x to the east and y to the north of the
recording's origin; headings are in degrees.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.columns import read_table
from coverdrive.recordings.files.delimited import ROW
from coverdrive.recordings.files.kinds import with_kinds
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.roads.carriageway import Line
from coverdrive.recordings.tracks.reading import name_of

HIGHD = "frame id x y width height xvelocity yvelocity"
LEVELX = "trackid frame xcenter ycenter heading width length xvelocity yvelocity"

CARRIAGEWAYS = {1: ("upper", "upperlanemarkings"), 2: ("lower", "lowerlanemarkings")}
"""Name of each driving direction, and the column of its lane markings"""


def companion(file: Path, what: str) -> Path:
    """The file beside a file of tracks that describes its vehicles (``tracksMeta``) or itself (``recordingMeta``)."""
    stem, found, _ = file.name.rpartition("tracks")
    path = file.with_name(f"{stem}{what}{file.suffix}")
    if not found or not path.is_file():
        problem = f"its description {path.name if found else f'NN_{what}.csv'} is not beside it"
        raise RecordingError(file, f"{problem}; expected NN_tracks.csv, NN_tracksMeta.csv and NN_recordingMeta.csv")
    return path


def frame_rate(description: Path, repairs: Counter[str]) -> float:
    """Frames per second, as the description of a recording states them."""
    rate = float(read_table(description, ("framerate",), repairs)["framerate"][0])
    if not rate > 0:
        raise RecordingError(description, f"expected frames per second, got {rate:g}", 2, "frameRate")
    return rate


def described(file: Path, rows: pl.DataFrame, description: Path, listed: pl.DataFrame, name: str) -> pl.DataFrame:
    """Rows with what a description lists of each ``vehicle``, whose column there has a name.

    Refused are vehicles of which it says nothing, or two different things.
    """
    twice = listed.unique(pl.exclude(ROW), maintain_order=True).filter(pl.col("vehicle").is_duplicated())
    if len(twice):
        problem = f"vehicle {twice['vehicle'][0]:g} is described twice, differently; remove what is wrong"
        raise RecordingError(description, problem, twice.filter(vehicle=twice["vehicle"][0])[ROW][-1], name)
    known = listed.drop(ROW).unique("vehicle").with_columns(listed=True)
    table = rows.join(known, on="vehicle", how="left", maintain_order="left")
    for row in table["listed"].is_null().arg_true():
        problem = f"vehicle {table['vehicle'][row]:g} is not in {description.name}"
        raise RecordingError(file, f"{problem}; check that both are of one recording", table[ROW][row], name)
    return table.drop("listed")


def read_highd(file: Path, how: How) -> list[MapTracks]:
    """The tracks of both carriageways, each with its lane markings."""
    vehicles, description = companion(file, "tracksMeta"), companion(file, "recordingMeta")
    repairs: Counter[str] = Counter()
    rows = read_table(file, HIGHD.split(), repairs)
    listed = read_table(vehicles, ("id", "drivingdirection", "class"), repairs)
    about = read_table(description, (), repairs, [column for _, column in CARRIAGEWAYS.values()])
    rate = frame_rate(description, repairs)
    if rows["width"].median() < rows["height"].median():  # pyright: ignore[reportOperatorIssue]
        problem = "most boxes are higher than wide; expected width along the road, that is the vehicle's length"
        raise RecordingError(file, f"{problem}: the columns width and height are swapped", None, "width")
    table = rows.select(
        ROW,
        vehicle="id",
        time=pl.col("frame") / rate,
        x=pl.col("x") + pl.col("width") / 2,
        y=-(pl.col("y") + pl.col("height") / 2),
        vx="xvelocity",
        vy=-pl.col("yvelocity"),
        length="width",
        width="height",
    )
    listed = listed.rename({"id": "vehicle", "drivingdirection": "direction"})
    table = described(file, table, vehicles, listed, "id")
    for row in (~table["direction"].is_in([float(each) for each in CARRIAGEWAYS])).arg_true():
        found = f"vehicle {table['vehicle'][row]:g} has no drivingDirection 1 or 2 in {vehicles.name}"
        raise RecordingError(file, f"{found}; check that both files are of one recording", table[ROW][row], "id")
    table = with_kinds(table, repairs)
    parts: list[MapTracks] = []
    for direction, (side, column) in CARRIAGEWAYS.items():
        own = table.filter(pl.col("direction") == direction).drop("direction")
        if len(own):
            lines = _markings(description, column, about[column][0], own) if column in about.columns else ()
            name = f"{name_of(file).removesuffix('_tracks')} {side}"
            parts.append(MapTracks(name, own, markings=lines, dt=1 / rate, repairs=repairs))
            repairs = Counter()
    return parts


def _markings(description: Path, column: str, text: str, table: pl.DataFrame) -> tuple[Line, ...]:
    """Lane markings as straight lines along all tracks; ``text`` holds their y [m], downward, between semicolons."""
    try:
        marks = [float(mark) for mark in text.split(";") if mark.strip()]
    except ValueError:
        marks = []
    if len(marks) < 2 or not np.isfinite(marks).all():
        problem = f"expected y of two or more markings, between semicolons, got {text!r}"
        raise RecordingError(description, problem, 2, column)
    ends = np.array([table["x"].min(), table["x"].max()], dtype=np.float64)
    return tuple(np.stack([ends, np.full(2, -mark)], axis=-1) for mark in marks)


def read_levelx(file: Path, how: How) -> list[MapTracks]:
    """The tracks of all vehicles; pedestrians and bicycles are left out."""
    vehicles, description = companion(file, "tracksMeta"), companion(file, "recordingMeta")
    repairs: Counter[str] = Counter()
    rows = read_table(file, LEVELX.split(), repairs)
    listed = read_table(vehicles, ("trackid", "class"), repairs)
    rate = frame_rate(description, repairs)
    table = rows.select(
        ROW,
        "length",
        "width",
        vehicle="trackid",
        time=pl.col("frame") / rate,
        x="xcenter",
        y="ycenter",
        vx="xvelocity",
        vy="yvelocity",
        heading=pl.col("heading") * (np.pi / 180),
    )
    table = described(file, table, vehicles, listed.rename({"trackid": "vehicle"}), "trackId")
    name = name_of(file).removesuffix("_tracks")
    x, y = (float(place[0]) for place in read_table(description, ("xutmorigin", "yutmorigin"), repairs)[:, 1:])
    return [MapTracks(name, with_kinds(table, repairs), origin=lambda _: (x, y), dt=1 / rate, repairs=repairs)]
