"""TGSIM (US DOT 2024): vehicles on motorways of Chicago and Washington, seen from helicopters and cameras.

Positions are in metres from the upper left corner of an image, so that y grows downward. Numbers of vehicles repeat
between runs; each run becomes a recording. Lane centre lines, one file a run, are used if they lie beside the tracks or
in a folder ``centerline``.
"""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.columns import read_table
from coverdrive.recordings.files.delimited import ROW, normalised
from coverdrive.recordings.formats.reader import Head, How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.roads.carriageway import Line
from coverdrive.recordings.tracks.reading import name_of

TGSIM = "id time xloc_kf yloc_kf"

COLUMNS = {
    "lane_kf": "lane",
    "speed_kf": "speed",
    "length_smoothed": "length",
    "width_smoothed": "width",
    "type_most_common": "type",
    "run_index": "run",
    "av": "automated",
}
"""Columns that are not in all files, and what they are called from here on"""

KIND_OF_TYPE = {3: 1, 4: 1, 5: 5, 6: 4, 7: 3}
"""Number in `KINDS` of each type, in files without a column ``av``: cars, automated cars, motorcycles, buses, trucks"""

APART = 1e5
"""[s] by which the clocks of successive runs are set apart, so that no minute holds two of them"""

OTHERS = (0.0, 1.0, 2.0)
"""The types of pedestrians, bicycles and scooters in these files"""

_LANE = re.compile(r"(x|y|\w*ramp\w*?)_?(\d+)")


def has_centre_lines(head: Head) -> bool:
    """Whether a file holds lane centre lines: columns x and y with the same lane's number."""
    return any(name.replace("x", "y", 1) in head.columns for name in head.columns if re.fullmatch(r"x_?\d+", name))


def read_tgsim(file: Path, how: How) -> list[MapTracks]:
    """The tracks of every run, with the centre lines of its lanes if there are any."""
    repairs: Counter[str] = Counter()
    rows = read_table(file, TGSIM.split(), repairs, tuple(COLUMNS))
    found = {name: new for name, new in COLUMNS.items() if name in rows.columns}
    table = rows.select(ROW, "time", *found, vehicle="id", x="xloc_kf", y=-pl.col("yloc_kf")).rename(found)
    if "type" in table.columns and "automated" not in table.columns:
        others = table["type"].is_in(OTHERS)
        repairs["rows of other road users"] += int(others.sum())
        kind = pl.col("type").cast(pl.Int64).replace_strict(KIND_OF_TYPE, default=0, return_dtype=pl.Int8)
        table = table.with_columns(kind=kind).filter(~others)
    if "run" not in table.columns:
        return [MapTracks(name_of(file), table, centres=_centre_lines(file, None), repairs=repairs, side="right")]
    runs = table.partition_by("run", as_dict=True, maintain_order=True)
    tracks: list[MapTracks] = []
    for (run,), own in runs.items():
        name, own = f"{name_of(file)} run {run:g}", own.with_columns(pl.col("time") + APART * run)
        tracks.append(MapTracks(name, own, centres=_centre_lines(file, int(run)), repairs=repairs, side="right"))
        repairs = Counter()
    return tracks


def _centre_lines(file: Path, run: int | None) -> tuple[Line, ...]:
    """The centre lines of the lanes of a run that are no ramps, if there is a file of them."""
    folders = [file.parent, *(each for each in file.parent.iterdir() if each.name.lower().startswith("centerline"))]
    wanted = re.compile(r"geometry" if run is None else rf"run_?{run}\D.*geometry", re.IGNORECASE)
    paths = [path for folder in folders for path in sorted(folder.glob("*.csv")) if wanted.search(path.name)]
    if not paths:
        return ()
    if len(paths) > 1:
        names = ", ".join(path.name for path in paths)
        raise RecordingError(file, f"several files of centre lines: {names}; leave the one of this run")
    try:
        table = pl.read_csv(paths[0].read_bytes(), infer_schema=False)
    except pl.exceptions.PolarsError as error:
        raise RecordingError(paths[0], f"it cannot be read as centre lines ({error}); check the file") from error
    columns = {normalised(name): table[name].cast(pl.Float64, strict=False) for name in table.columns}
    lanes: dict[str, dict[str, pl.Series]] = {}
    for name, values in columns.items():
        if matched := _LANE.fullmatch(name):
            lanes.setdefault(matched[2], {})["ramp" if "ramp" in matched[1] else matched[1]] = values
    lines: list[Line] = []
    for lane in lanes.values():
        ramp = "ramp" in lane and np.median(lane["ramp"].drop_nulls().to_numpy()) > 0
        if "x" in lane and "y" in lane and not ramp:
            points = pl.DataFrame({"x": lane["x"], "y": -lane["y"]}).drop_nulls().to_numpy()
            if len(points) > 1 and np.isfinite(points).all():
                lines.append(points)
    if not lines:
        raise RecordingError(paths[0], "it holds no centre line; expected columns x_1, y_1, x_2, y_2 and so on")
    return tuple(lines)
