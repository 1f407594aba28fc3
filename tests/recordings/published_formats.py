"""Writes generated traffic as public data sets publish theirs, by their descriptions alone.

The truth is a table of both carriageways of a straight motorway: along [m] and left [m] from the right edge of the own
carriageway, in its direction of travel. `placed` puts it onto a map whose x and y are right-handed.
"""

import json
from collections.abc import Callable
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

LENGTH, MEDIAN, WIDTH = 800.0, 6.0, 10.8
"""[m] of the road, between the carriageways, and of each of these"""

EDGES = (0.0, 3.6, 7.2, 10.8)


class Truth:
    """The same vehicles as the reader should find them, made when somebody first looks at them."""

    def __init__(self, tables: Callable[[], tuple[pl.DataFrame, ...]] | tuple[pl.DataFrame, ...], dt: float):
        self._tables, self.dt = tables, dt

    @cached_property
    def tables(self) -> tuple[pl.DataFrame, ...]:
        """Of each carriageway, eastbound first: as a recording's, and a column ``frame`` from 1."""
        return self._tables if isinstance(self._tables, tuple) else self._tables()


def truth(dt: float, carriageways: int = 2, seconds: float = 12.0, seed: int = 3) -> Truth:
    """Generated traffic; vehicles are numbered from 0 through both carriageways."""
    return Truth(lambda: _tables(dt, carriageways, seconds, seed), dt)


@cache
def _tables(dt: float, carriageways: int, seconds: float, seed: int) -> tuple[pl.DataFrame, ...]:
    settings = GeneratedSettings(scenes=carriageways, duration=seconds, dt=dt, vehicles=(18, 24))
    frame = (pl.col("time") / dt).round().cast(pl.Int64) + 1
    tables = [recording.table.with_columns(frame=frame) for recording in generate(settings, seed)]
    inside = pl.concat(tables).filter(pl.col("lon").is_between(0, LENGTH))
    numbered = inside.with_columns(vehicle=pl.col("vehicle").rank("dense").cast(pl.Int64) - 1)
    return tuple(numbered.partition_by("group", maintain_order=True))


def bent(u: Any, v: Any, curvature: float) -> tuple[Any, Any]:
    """Where places along and to the left of a line are if it begins straight on and has a curvature [1/m]."""
    if not curvature:
        return u, v
    return np.sin(curvature * u) * (1 / curvature - v), 1 / curvature - np.cos(curvature * u) * (1 / curvature - v)


def placed(
    real: Truth, degrees: float = 0.0, east: float = 0.0, north: float = 0.0, curvature: float = 0.0
) -> pl.DataFrame:
    """Both carriageways on one map: traffic keeps to the right, eastbound below; the road turned by an angle, or bent.

    The right edge of the eastbound one has the curvature [1/m].
    """
    parts: list[pl.DataFrame] = []
    for number, table in enumerate(real.tables):
        sign = 1 - 2 * number
        along = pl.col("lon") if number == 0 else LENGTH - pl.col("lon")
        across = pl.col("lat") if number == 0 else 2 * WIDTH + MEDIAN - pl.col("lat")
        heading = pl.col("heading") + (0.0 if number == 0 else np.pi)
        parts.append(table.with_columns(across=across, along=along, heading=heading, direction=pl.lit(sign)))
    turn, both = np.radians(degrees), pl.concat(parts)
    u, v = bent(both["along"], both["across"], curvature)
    heading = both["heading"] + both["along"] * curvature + turn
    speed = both["speed"] * (1 - both["across"] * curvature)
    return both.with_columns(
        x=east + u * np.cos(turn) - v * np.sin(turn),
        y=north + u * np.sin(turn) + v * np.cos(turn),
        heading=heading,
        speed=speed,
        vx=speed * heading.cos(),
        vy=speed * heading.sin(),
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


def write_exid(folder: Path, real: Truth, degrees: float = 60.0, curvature: float = 0.0, **changes: pl.Expr) -> Path:
    """``03_tracks.csv`` and its two descriptions: centres in metres, y up, headings in degrees, lists of lanelets."""
    seen = placed(real, degrees, 120.0, -80.0, curvature)
    rows = seen.select(
        recordingId=pl.lit(3),
        trackId=pl.col("vehicle") + 1,
        frame=pl.col("frame") - 1,
        xCenter="x",
        yCenter="y",
        heading=pl.col("heading").degrees() % 360,
        width="width",
        length="length",
        xVelocity="vx",
        yVelocity="vy",
        lonVelocity="speed",
        laneWidth=pl.lit("3.6;3.6"),
        laneletId=pl.lit("1201;1202"),
    ).sort("trackId", "frame")
    rows.with_columns(pl.col(pl.Float64).round(5)).with_columns(**changes).write_csv(folder / "03_tracks.csv")
    listed = seen.group_by("vehicle").agg(
        pl.col("length", "width", "truck").first(),
        initialFrame=pl.col("frame").min() - 1,
        finalFrame=pl.col("frame").max() - 1,
        numFrames=pl.len(),
    )
    listed.select(
        recordingId=pl.lit(3),
        trackId=pl.col("vehicle") + 1,
        initialFrame="initialFrame",
        finalFrame="finalFrame",
        numFrames="numFrames",
        width="width",
        length="length",
        **{"class": pl.when("truck").then(pl.lit("truck")).otherwise(pl.lit("car"))},
    ).sort("trackId").write_csv(folder / "03_tracksMeta.csv")
    (folder / "03_recordingMeta.csv").write_text(
        "recordingId,locationId,frameRate,speedLimit,weekday,startTime,duration,numTracks,xUtmOrigin,yUtmOrigin\n"
        f"3,0,{1 / real.dt:g},-1,tuesday,9.0,12.0,{len(listed)},500000.0,0.0\n"
    )
    return folder / "03_tracks.csv"


def write_interaction(
    folder: Path, real: Truth, degrees: float = 200.0, curvature: float = 0.0, **changes: pl.Expr
) -> Path:
    """``vehicle_tracks_007.csv``: 10 Hz, times in milliseconds from 100, headings in rad."""
    rows = placed(real, degrees, 1000.0, 1000.0, curvature).select(
        track_id=pl.col("vehicle") + 1,
        frame_id="frame",
        timestamp_ms=100 * pl.col("frame"),
        agent_type=pl.lit("car"),
        x="x",
        y="y",
        vx="vx",
        vy="vy",
        psi_rad=(pl.col("heading") + np.pi) % (2 * np.pi) - np.pi,
        length="length",
        width="width",
    )
    path = folder / "vehicle_tracks_007.csv"
    rows.sort("track_id", "frame_id").with_columns(pl.col(pl.Float64).round(3)).with_columns(**changes).write_csv(path)
    return path


def write_mona(folder: Path, real: Truth, suffix: str = "csv", **changes: pl.Expr) -> Path:
    """``east_000_001/trajectories``: 25 Hz, frames, speeds without directions, coordinates from a UTM origin."""
    rows = placed(real, degrees=75.0, east=245.0, north=-912.0).select(
        track_id=pl.col("vehicle") + 1,
        frame_id="frame",
        agent_type=pl.when("truck").then(pl.lit("truck")).otherwise(pl.lit("car")),
        x="x",
        y="y",
        v="speed",
        psi_rad=(pl.col("heading") + np.pi) % (2 * np.pi) - np.pi,
        yaw_rate=pl.lit(0.0),
        length="length",
        width="width",
    )
    (folder / "east_000_001").mkdir()
    path = folder / "east_000_001" / f"trajectories.{suffix}"
    changed = rows.with_columns(**changes)
    changed.write_csv(path) if suffix == "csv" else changed.write_parquet(path)
    return path


def write_tgsim(folder: Path, runs: list[Truth], hyphens: bool = False, tall: bool = False, **changes: pl.Expr) -> Path:
    """``TGSIM.csv``: 10 Hz, y downward from an image's upper left corner, numbers of vehicles repeat between runs.

    Either spelling of the columns; the road runs along x, or along y as on I-395. Each run goes one way.
    """
    parts: list[pl.DataFrame] = []
    for number, real in enumerate(runs, 1):
        seen = placed(Truth(real.tables[:1], real.dt), degrees=-90.0 if tall else 0.0, east=40.0, north=-30.0)
        parts.append(
            seen.select(
                id=pl.col("vehicle") + 1,
                time=pl.col("time").round(2),
                xloc_kf="x",
                yloc_kf=-pl.col("y"),
                lane_kf=3 - (pl.col("lat") / 3.6).floor().clip(0, 2),
                speed_kf="speed",
                acceleration_kf=pl.lit(0.0),
                length_smoothed="length",
                width_smoothed="width",
                type_most_common=pl.when("truck").then(7).otherwise(3),
                run_index=pl.lit(number),
            )
        )
    table = pl.concat(parts).with_columns(pl.col(pl.Float64).round(4)).with_columns(**changes)
    if hyphens:
        table = table.rename({"id": "ID", **{name: name.replace("_", "-") for name in table.columns if name != "id"}})
    table.write_csv(folder / "TGSIM.csv")
    return folder / "TGSIM.csv"


def write_centre_lines(folder: Path, run: int) -> Path:
    """The centre lines of the three lanes of a run of `write_tgsim`, and of a ramp beside them."""
    along = np.arange(0.0, LENGTH, 10.0)
    columns: dict[str, object] = {}
    for lane, left in ((1, 9.0), (2, 5.4), (3, 1.8), (9, -3.0)):
        columns |= {f"x_{lane}": 40.0 + along, f"y_{lane}": np.full_like(along, 30.0 - left)}
        columns |= {f"ramp_{lane}": np.full_like(along, lane == 9)}
    (folder / "centerline").mkdir(exist_ok=True)
    path = folder / "centerline" / f"I-90-stationary-Run_{run}-geometry-with-ramps.csv"
    pl.DataFrame(columns).write_csv(path)
    return path


def write_i24(folder: Path, real: Truth, lines: bool = False, signed: bool = True) -> Path:
    """``i24.json``: feet, POSIX times, one object a trajectory; y is 0 at the median.

    ``signed``: y is negative for eastbound traffic; otherwise it grows to the right shoulder in both directions.
    """
    records: list[dict[str, object]] = []
    for (number,), rows in placed(real).sort("vehicle", "frame").partition_by("vehicle", as_dict=True).items():
        sign = int(rows["direction"][0])
        back = rows["x"] - sign * rows["length"] / 2
        left = rows["y"] - (WIDTH + MEDIAN / 2)
        records.append(
            {
                "_id": {"$oid": f"{number:024x}"},
                "timestamp": (1.6e9 + rows["time"] + 1e-4 * (number % 7)).to_list(),
                "x_position": (309_804.0625 + back / 0.3048).to_list(),
                "y_position": ((left if signed else left.abs()) / 0.3048).to_list(),
                "length": rows["length"][0] / 0.3048,
                "width": rows["width"][0] / 0.3048,
                "height": 5.0,
                "direction": sign,
                "coarse_vehicle_class": 4 if rows["truck"][0] else 0,
            }
        )
    texts = [json.dumps(record) for record in records]
    (folder / "i24.json").write_text("\n".join(texts) if lines else "[" + ",\n".join(texts) + "]\n")
    return folder / "i24.json"


def write_lanelets(
    folder: Path, degrees: float = 60.0, pieces: int = 3, curvature: float = 0.0, **place: float
) -> Path:
    """``lanelets.osm``: both carriageways of `placed` in pieces, around a place near the equator; a crosswalk.

    There, UTM coordinates are those of a sphere's tangent plane to a few centimetres: the place is 111 m north of the
    equator on a central meridian, so that metres are degrees of the ellipsoid. Every second bound is drawn backwards.
    """
    turn, nodes, ways, relations = np.radians(degrees), dict[tuple[float, float], int](), list[str](), list[str]()

    def node(u: float, v: float) -> int:
        return nodes.setdefault((round(u, 3), round(v, 3)), len(nodes) + 1)

    def way(first: float, last: float, v: float) -> int:
        refs = [node(u, v) for u in np.linspace(first, last, 12)]
        turned = refs[::-1] if len(ways) % 2 else refs
        ways.append("".join(f'<nd ref="{ref}"/>' for ref in turned))
        return len(ways)

    ends = np.linspace(-10.0, LENGTH + 10.0, pieces + 1)
    for base in (0.0, WIDTH + MEDIAN):
        for first, last in pairwise(ends):
            bounds = [way(first, last, base + edge) for edge in EDGES]
            for right, left in pairwise(bounds if base == 0 else bounds[::-1]):  # the upper one is driven the other way
                refs = (("left", left), ("right", right))
                members = "".join(f'<member role="{role}" type="way" ref="{ref}"/>' for role, ref in refs)
                kind = '<tag k="type" v="lanelet"/><tag k="subtype" v="highway"/><tag k="one_way" v="yes"/>'
                relations.append(members + kind)
    relations.append(relations[0].replace("highway", "crosswalk"))
    metre = 180 / np.pi / 6_378_137.0 / 0.9996
    text = ['<?xml version="1.0"?><osm version="0.6">']
    for (along, across), number in nodes.items():
        u, v = bent(along, across, curvature)
        x = place.get("east", 120.0) + u * np.cos(turn) - v * np.sin(turn)
        y = place.get("north", -80.0) + u * np.sin(turn) + v * np.cos(turn)
        north = metre / (1 - 1 / 298.257223563) ** 2  # the ellipsoid is more curved along the meridian
        text.append(f'<node id="{number}" lat="{y * north:.12f}" lon="{9.0 + x * metre:.12f}"/>')
    text += [f'<way id="{number}">{refs}</way>' for number, refs in enumerate(ways, 1)]
    text += [f'<relation id="{number}">{members}</relation>' for number, members in enumerate(relations, 900)]
    (folder / "lanelets.osm").write_text("".join([*text, "</osm>"]))
    return folder / "lanelets.osm"


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
