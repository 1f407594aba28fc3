"""I-24 MOTION (Gloudemans et al. 2023): trajectories of both carriageways of 4 miles, in feet, read one by one.

A file is a JSON array of one object for each trajectory, or one object on each line. ``x_position`` grows eastward
along the road, ``y_position`` away from the yellow line at the median; the point is in the middle of a vehicle's back.
``direction`` is 1 eastbound and −1 westbound. No lanes are given, so they are estimated.
"""

import codecs
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from jaxtyping import Float

from coverdrive.errors import RecordingError
from coverdrive.progress import done
from coverdrive.recordings.checks import LARGEST, LENGTHS
from coverdrive.recordings.files.columns import LENGTH
from coverdrive.recordings.formats.ngsim import FOOT
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.tracks.reading import check_time_step, name_of
from coverdrive.recordings.tracks.repair import LONGEST_GAP

SERIES = ("timestamp", "x_position", "y_position")
SINGLE = ("length", "width", "direction", "coarse_vehicle_class")

KIND_OF_CLASS = (1, 1, 2, 1, 3, 3)
"""Number in `KINDS` of sedan, midsize, van, pickup, semi-trailer and truck"""

CHUNK, LONGEST = 2**22, 2**28
"""Characters that are read at a time, and that one trajectory may have"""

MOST_ROWS = 20_000_000
"""of a file, about 4 GB of memory"""


def read_i24(file: Path, how: How) -> list[MapTracks]:
    """All trajectories, on the time grid of the first one; those of one point are left out as ``dropped tracks``."""
    repairs: Counter[str] = Counter()
    parts: list[pl.DataFrame] = []
    rows, dt, start, eastward = 0, 0.0, 0.0, 0.0
    for number, record in enumerate(_records(file)):
        series, single = _numbers(file, number, record)
        time = series[0]
        if len(time) < 2:
            repairs["dropped tracks"] += 1
            continue
        if np.any(np.diff(time) <= 0):
            problem = f"the times of trajectory {number + 1} do not ascend; put them right or remove it"
            raise RecordingError(file, problem)
        if not parts:
            dt, start = round(float(np.median(np.diff(time))), 3), float(np.floor(time[0]))
            check_time_step(file, dt, "the time between two points")
        parts.append(_track(number, series, single, dt, start))
        rows += len(parts[-1])
        eastward += single[2] * (series[1, -1] - series[1, 0])
        if rows > MOST_ROWS:
            problem = f"the file has more than {MOST_ROWS:,} points; cut it into pieces of some minutes"
            raise RecordingError(file, problem)
    if not parts:
        raise RecordingError(file, "the file holds no trajectory; check that it was copied whole")
    if eastward < 0:
        problem = "vehicles of direction 1 drive towards smaller x_position; expected them to drive eastward, along it"
        raise RecordingError(file, f"{problem}: check direction and x_position")
    table = pl.concat(parts)
    side = pl.col("y").median().sign().over("direction")  # either side of the median, or both counted alike
    table = table.with_columns(y=-pl.col("direction") * pl.col("y") * pl.when(side == 0).then(1).otherwise(side))
    line = np.array([[table["x"].min(), 0.0], [table["x"].max(), 0.0]], dtype=np.float64)
    return [MapTracks(name_of(file), table.drop("direction"), line=line, dt=dt, repairs=repairs)]


def _track(
    number: int, series: Float[np.ndarray, "3 P"], single: Float[np.ndarray, " 4"], dt: float, start: float
) -> pl.DataFrame:
    """One trajectory in metres at multiples of the time step after the start [s], its centre between its points.

    In a pause that is too long to know where it is, it is nowhere.
    """
    time, x, y = series
    length, width, direction, kind = single
    inside = LENGTHS[0] <= length * FOOT <= LENGTHS[1]
    to_centre = (length * FOOT if inside else LENGTH) / 2  # as another length is mended
    pauses = np.flatnonzero(np.diff(time) > LONGEST_GAP + dt / 2)
    parts = zip(time[np.insert(pauses + 1, 0, 0)] - start, time[np.append(pauses, -1)] - start, strict=True)
    grids = [np.arange(np.ceil(first / dt - 1e-3), np.floor(last / dt + 1e-3) + 1) for first, last in parts]
    moments = np.concatenate(grids)
    at = start + moments * dt
    known = 0 <= kind < len(KIND_OF_CLASS)
    return pl.DataFrame(
        {
            "vehicle": np.full(len(at), number, dtype=np.int64),
            "time": moments * dt,
            "x": np.interp(at, time, x) * FOOT + direction * to_centre,
            "y": np.interp(at, time, y) * FOOT,
            "length": np.full(len(at), length * FOOT),
            "width": np.full(len(at), width * FOOT),
            "direction": np.full(len(at), direction),
            "kind": np.full(len(at), KIND_OF_CLASS[int(kind)] if known else 0, dtype=np.int8),
        }
    )


def _numbers(file: Path, number: int, record: Any) -> tuple[Float[np.ndarray, "3 P"], Float[np.ndarray, " 4"]]:
    """Series and single values of a trajectory: finite numbers, series of one length, a direction of ±1."""
    try:
        series = np.array([record[name] for name in SERIES], dtype=np.float64)
        single = np.array([record[name] for name in SINGLE], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        series, single = np.empty(0), np.empty(0)
    whole = series.ndim == 2 and np.all(np.abs(series) < LARGEST) and np.all(np.abs(single) < LARGEST)
    if not whole or abs(single[2]) != 1:
        problem = f"trajectory {number + 1} is damaged; expected lists of as many numbers {', '.join(SERIES)}, and"
        raise RecordingError(file, f"{problem} numbers {', '.join(SINGLE)}, with direction 1 or -1")
    return series, single


def _records(file: Path) -> Iterator[Any]:
    """The objects of a JSON array, or of a file of JSON objects, one after the other; only one is held at a time."""
    decoder, text, size = json.JSONDecoder(parse_int=float), "", file.stat().st_size
    read = codecs.getincrementaldecoder("utf-8")("replace").decode
    with file.open("rb") as stream:
        more = True
        while more:
            chunk = stream.read(max(CHUNK, len(text)))
            text, more = text + read(chunk, not chunk), bool(chunk)
            place = 0
            while True:
                while place < len(text) and text[place] in " \t\r\n[,]":
                    place += 1
                try:
                    record, place = decoder.raw_decode(text, place)
                except (json.JSONDecodeError, RecursionError):
                    break
                yield record
            text = text[place:]
            done(min(stream.tell(), size), size)
            if len(text) > LONGEST:
                raise RecordingError(file, f"a trajectory has more than {LONGEST} characters; check that it is JSON")
    if text:
        problem = f"the file is cut or no JSON after its last whole trajectory, at {text[:30]!r}"
        raise RecordingError(file, f"{problem}; check that it was copied whole")
