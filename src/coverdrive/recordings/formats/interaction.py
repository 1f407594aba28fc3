"""INTERACTION (Zhan et al. 2019) and MONA (Gressenbuch et al. 2022), which name their columns alike.

Positions are centres, in metres of a map whose y is up; headings are in rad. INTERACTION states times in milliseconds;
the 25 frames per second of MONA are those that its own converter to CommonRoad counts with.
"""

from collections import Counter
from functools import partial
from pathlib import Path

import polars as pl

from coverdrive.recordings.files.columns import read_table
from coverdrive.recordings.files.delimited import ROW
from coverdrive.recordings.files.kinds import with_kinds
from coverdrive.recordings.files.lanelet2 import utm
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.tracks.reading import name_of

INTERACTION = "track_id frame_id timestamp_ms agent_type x y vx vy psi_rad length width"
MONA = "track_id frame_id agent_type x y v psi_rad length width"

MONA_STEP = 0.04
"""[s] between two frames of MONA"""


def read_interaction(file: Path, how: How) -> list[MapTracks]:
    """The vehicles of a file ``vehicle_tracks_NNN.csv``; those of pedestrians are other files."""
    repairs: Counter[str] = Counter()
    rows = read_table(file, INTERACTION.split(), repairs)
    table = _shared(rows).with_columns(rows["vx"], rows["vy"], time=rows["timestamp_ms"] / 1000)
    origin = partial(utm, 0.0, 0.0)  # where the equator meets the zero meridian
    return [MapTracks(name_of(file), with_kinds(table, repairs), origin=origin, repairs=repairs)]


def read_mona(file: Path, how: How) -> list[MapTracks]:
    """The vehicles of a file ``trajectories.csv`` or ``.parquet``, called after its folder."""
    repairs: Counter[str] = Counter()
    rows = read_table(file, MONA.split(), repairs)
    table = _shared(rows).with_columns(speed=rows["v"], time=rows["frame_id"] * MONA_STEP)
    name = name_of(file.absolute().parent if file.stem == "trajectories" else file)
    return [MapTracks(name, with_kinds(table, repairs), dt=MONA_STEP, repairs=repairs)]


def _shared(rows: pl.DataFrame) -> pl.DataFrame:
    """The columns that both have, by their usual names."""
    return rows.select(
        ROW, "x", "y", "length", "width", vehicle="track_id", heading="psi_rad", **{"class": pl.col("agent_type")}
    )
