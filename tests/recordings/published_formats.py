"""Writes generated traffic as public data sets publish theirs, by their descriptions alone.

The truth is a table of both carriageways of a straight motorway: along [m] and left [m] from the right edge of the own
carriageway, in its direction of travel. `placed` puts it onto a map whose x and y are right-handed.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from coverdrive.recordings.recording import Recording
from coverdrive.simulation.generated import GeneratedSettings, generate

LENGTH, MEDIAN, WIDTH = 800.0, 6.0, 10.8
"""[m] of the road, between the carriageways, and of each of these"""

EDGES = (0.0, 3.6, 7.2, 10.8)


class Truth(NamedTuple):
    """The same vehicles as the reader should find them."""

    tables: tuple[pl.DataFrame, ...]
    """of each carriageway, eastbound first: as a recording's, and a column ``frame`` from 1"""
    dt: float


def truth(dt: float, carriageways: int = 2, seconds: float = 12.0, seed: int = 3) -> Truth:
    """Generated traffic; numbers of vehicles are unique in both carriageways."""
    settings = GeneratedSettings(scenes=carriageways, duration=seconds, dt=dt, vehicles=(18, 24))
    return Truth(tuple(_table(recording, dt) for recording in generate(settings, seed)), dt)


def _table(recording: Recording, dt: float) -> pl.DataFrame:
    inside = recording.table.filter(pl.col("lon").is_between(0, LENGTH))
    return inside.with_columns(frame=(pl.col("time") / dt).round().cast(pl.Int64) + 1)


def placed(real: Truth, degrees: float = 0.0, east: float = 0.0, north: float = 0.0) -> pl.DataFrame:
    """Both carriageways on one map: traffic keeps to the right, eastbound below; the road turned by an angle."""
    parts: list[pl.DataFrame] = []
    for number, table in enumerate(real.tables):
        sign = 1 - 2 * number
        along = pl.col("lon") if number == 0 else LENGTH - pl.col("lon")
        across = pl.col("lat") if number == 0 else 2 * WIDTH + MEDIAN - pl.col("lat")
        heading = pl.col("heading") + (0.0 if number == 0 else np.pi)
        parts.append(table.with_columns(across=across, along=along, heading=heading, direction=pl.lit(sign)))
    turn = np.radians(degrees)
    u, v = pl.col("along"), pl.col("across")
    heading = pl.col("heading") + turn
    return pl.concat(parts).with_columns(
        x=east + u * np.cos(turn) - v * np.sin(turn),
        y=north + u * np.sin(turn) + v * np.cos(turn),
        heading=heading,
        vx=pl.col("speed") * heading.cos(),
        vy=pl.col("speed") * heading.sin(),
        truck=pl.col("length") > 8,
    )


def write_highd(folder: Path, real: Truth, **changes: pl.Expr) -> Path:
    """``01_tracks.csv`` and its two descriptions: the upper left corner of each box, y downward, width along x."""
    seen = placed(real)
    top = 2 * WIDTH + MEDIAN + 4.0
    corner = {"x": pl.col("x") - pl.col("length") / 2, "y": top - pl.col("y") - pl.col("width") / 2}
    rows = seen.select(
        "frame",
        id=pl.col("vehicle") + 1,
        **corner,
        width="length",
        height="width",
        xVelocity="vx",
        yVelocity=-pl.col("vy"),
        frontSightDistance=pl.lit(0.0),
        laneId=(pl.col("lat") / 3.6).floor().cast(pl.Int64) + 2,
    ).sort("id", "frame")
    rows.with_columns(pl.col(pl.Float64).round(4)).with_columns(**changes).write_csv(folder / "01_tracks.csv")
    listed = seen.group_by("vehicle").agg(
        pl.col("length", "width", "direction", "truck").first(),
        initialFrame=pl.col("frame").min(),
        finalFrame=pl.col("frame").max(),
        numFrames=pl.len(),
    )
    listed.select(
        id=pl.col("vehicle") + 1,
        width="length",
        height="width",
        initialFrame="initialFrame",
        finalFrame="finalFrame",
        numFrames="numFrames",
        **{"class": pl.when("truck").then(pl.lit("Truck")).otherwise(pl.lit("Car"))},
        drivingDirection=pl.when(pl.col("direction") > 0).then(2).otherwise(1),
    ).sort("id").write_csv(folder / "01_tracksMeta.csv")
    upper = ";".join(f"{4.0 + edge:.2f}" for edge in EDGES)
    lower = ";".join(f"{4.0 + WIDTH + MEDIAN + edge:.2f}" for edge in EDGES)
    (folder / "01_recordingMeta.csv").write_text(
        "id,frameRate,locationId,speedLimit,month,weekDay,startTime,duration,upperLaneMarkings,lowerLaneMarkings\n"
        f"1,{1 / real.dt:g},2,-1.00,9.2017,Tue,08:38,12.0,{upper},{lower}\n"
    )
    return folder / "01_tracks.csv"


def found_again(recording: Recording, real: pl.DataFrame, shift: float, first: int = 1) -> dict[str, float]:
    """Largest difference of every measure from the truth, whose positions along the road count from another place.

    The recording's times are ``shift`` [s] later, and its vehicles are numbered from ``first`` on.
    """
    worst = dict.fromkeys(("lon", "lat", "speed", "heading"), 0.0)
    pairs = [
        (own, real.filter(pl.col("vehicle") == number - first))
        for (number,), own in recording.table.partition_by("vehicle", as_dict=True).items()
    ]
    start = np.median(np.concatenate([own["lon"].to_numpy() - _at(own, same, shift, "lon") for own, same in pairs]))
    for own, same in pairs:
        for name in worst:
            away = np.abs(own[name].to_numpy() - _at(own, same, shift, name) - (start if name == "lon" else 0.0))
            worst[name] = max(worst[name], float(away.max()))
    return worst


def _at(own: pl.DataFrame, same: pl.DataFrame, shift: float, name: str) -> np.ndarray:
    return np.interp(own["time"].to_numpy() - shift, same["time"].to_numpy(), same[name].to_numpy())
