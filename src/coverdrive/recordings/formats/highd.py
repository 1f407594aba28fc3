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
from coverdrive.recordings.formats.descriptions import (
    LISTED,
    check_described,
    check_recording,
    companion,
    described,
    frame_rate,
)
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.roads.carriageway import Line
from coverdrive.recordings.tracks.reading import name_of

HIGHD = "frame id x y width height xvelocity yvelocity"
LEVELX = "trackid frame xcenter ycenter heading width length xvelocity yvelocity"

CARRIAGEWAYS = {1: ("upper", "upperlanemarkings"), 2: ("lower", "lowerlanemarkings")}
"""Name of each driving direction, and the column of its lane markings"""


def read_highd(file: Path, how: How) -> list[MapTracks]:
    """The tracks of both carriageways, each with its lane markings."""
    vehicles, description = companion(file, "tracksMeta"), companion(file, "recordingMeta")
    repairs: Counter[str] = Counter()
    rows = read_table(file, HIGHD.split(), repairs)
    listed = read_table(vehicles, ("id", "drivingdirection", "class"), repairs, (*LISTED, "height"))
    numbers = ("numvehicles", "numcars", "numtrucks")
    about = read_table(
        description, ("framerate",), repairs, (*numbers, *(column for _, column in CARRIAGEWAYS.values()))
    )
    rate = frame_rate(description, about)
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
    kinds = listed.select(ROW, "class", vehicle="id", direction="drivingdirection")
    table = described(file, table, vehicles, kinds, "id")
    check_described(file, rows, vehicles, listed, "id", ("width", "height"))
    once = listed.unique("id")["class"]
    check_recording(description, about, {"numvehicles": len(once)}, vehicles.name)
    if once.is_in(("car", "truck")).all():
        own = {f"num{kind}s": int((once == kind).sum()) for kind in ("car", "truck")}
        check_recording(description, about, own, vehicles.name)
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
    rows = read_table(file, LEVELX.split(), repairs, ("recordingid",))
    listed = read_table(vehicles, ("trackid", "class"), repairs, (*LISTED, "length", "recordingid"))
    wanted = ("framerate", "xutmorigin", "yutmorigin")
    about = read_table(description, wanted, repairs, ("numtracks", "recordingid"))
    rate = frame_rate(description, about)
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
    kinds = listed.select(ROW, "class", vehicle="trackid")
    table = described(file, table, vehicles, kinds, "trackId")
    if "recordingid" in rows.columns:
        own = {"recordingid": rows["recordingid"][0]}
        for other, numbers in ((file, rows), (vehicles, listed), (description, about)):
            check_recording(other, numbers, own, f"the first row of {file.name}")
    check_described(file, rows, vehicles, listed, "trackid", ("length", "width"))
    check_recording(description, about, {"numtracks": listed["trackid"].n_unique()}, vehicles.name)
    name = name_of(file).removesuffix("_tracks")
    x, y = about["xutmorigin"][0], about["yutmorigin"][0]
    return [MapTracks(name, with_kinds(table, repairs), origin=lambda _: (x, y), dt=1 / rate, repairs=repairs)]
