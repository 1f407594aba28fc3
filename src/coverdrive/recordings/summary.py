"""What is in recordings, for people: one line for each, and what shows a wrong unit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from jaxtyping import Float

from coverdrive.recordings.recording import Recording


@dataclass(frozen=True)
class Summary:
    """One recording in a few numbers."""

    name: str
    groups: tuple[int, ...]
    """groups that its rows belong to, ascending"""
    vehicles: int
    """number of tracks"""
    minutes: float
    """[min] from the first to the last row"""
    rows: int
    """one for each vehicle and moment"""
    lanes: int
    mean_speed: float
    """[m/s] over all rows"""
    max_speed: float
    """[m/s]"""
    dt: float
    """[s]"""
    repairs: dict[str, int]
    """how often each kind of repair was made"""
    notes: dict[str, str]
    """format, where the lanes are from, how it was resampled"""


def summarise(recordings: Sequence[Recording]) -> list[Summary]:
    """The summary of every recording, in their order."""
    return [
        Summary(
            name=recording.name,
            groups=tuple(recording.table["group"].unique().sort()),
            vehicles=recording.table["vehicle"].n_unique(),
            minutes=float(np.ptp(recording.table["time"].to_numpy())) / 60,
            rows=len(recording.table),
            lanes=recording.road.lanes,
            mean_speed=float(recording.table["speed"].to_numpy().mean()),
            max_speed=float(recording.table["speed"].to_numpy().max()),
            dt=recording.dt,
            repairs=recording.repairs,
            notes=recording.notes,
        )
        for recording in recordings
    ]


def accelerations(recording: Recording) -> Float[np.ndarray, " n"]:
    """[m/s²] along the heading, from each row of a track to the next."""
    table = recording.table.with_columns(pl.col("speed", "time").diff().over("vehicle", "group"))
    return table.filter(pl.col("time") < 1.5 * recording.dt)["speed"].to_numpy() / recording.dt


def following(recording: Recording) -> pl.DataFrame:
    """Every vehicle at every moment that has one ahead in its lane: ``gap`` to it and ``spacing`` [m], ``speed`` [m/s].

    The gap is from bumper to bumper along the road, the spacing from centre to centre.
    """
    lon, lat = (recording.table[name].to_numpy() for name in ("lon", "lat"))
    table = recording.table.select(
        pl.col("time", "group", "lon", "length", "speed"),
        lane=pl.Series(recording.road.lane_at(lon, lat)),
        stretch=pl.Series(recording.road.stretch(lon, lat)),
    ).sort("group", "time", "lane", "lon")
    way, length, stretch = (pl.col("lon").diff(-1), pl.col("length"), pl.col("stretch"))
    both, spacing = (length + length.shift(-1)) / 2, -way * (stretch + stretch.shift(-1)) / 2
    leads = pl.all_horizontal(pl.col(name) == pl.col(name).shift(-1) for name in ("group", "time", "lane"))
    return table.select("speed", spacing=spacing, gap=spacing - both, leads=leads).filter("leads").drop("leads")
