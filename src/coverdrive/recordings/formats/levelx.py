"""exiD, inD, rounD and uniD (Moers et al. 2022, Bock et al. 2020): road users seen from a drone, in metres.

``NN_tracks.csv`` comes with ``NN_tracksMeta.csv`` (class of every road user) and ``NN_recordingMeta.csv`` (frame rate).
Positions are centres, x to the east and y to the north of the recording's origin; headings are in degrees.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.recordings.files.columns import read_table
from coverdrive.recordings.files.delimited import ROW
from coverdrive.recordings.files.kinds import with_kinds
from coverdrive.recordings.formats.highd import companion, described, frame_rate
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.tracks.reading import name_of

LEVELX = "trackid frame xcenter ycenter heading width length xvelocity yvelocity"
LEVELX_VEHICLES = "recordingid trackid initialframe finalframe"
LEVELX_RECORDING = "recordingid framerate locationid"


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
