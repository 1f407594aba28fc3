"""Recorded traffic on one road, as every reader yields it: SI units, road frame, vehicle centres.

Input of the trajectory basis (paper §2.1) and of the affordances (§2.2). F is the number of moments (frames), A
the largest number of vehicles seen at one moment.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import jax
import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.arguments import finite
from coverdrive.errors import DataError
from coverdrive.recordings.checks import check, wrong_time_step
from coverdrive.road import Road
from coverdrive.scene import Scene

MEASURES = ("lon", "lat", "speed", "heading", "length", "width")
"""The columns of a recording's table that `Scene` holds, in its order."""

SCHEMA = pl.Schema({"vehicle": pl.Int64, "group": pl.Int64, "time": pl.Float64} | dict.fromkeys(MEASURES, pl.Float64))
"""Columns and types of a recording's table that there have to be."""

SEEN = pl.Schema(dict.fromkeys([f"seen_{name}" for name in MEASURES[:4]], pl.Float64))
"""What could be seen of the same row at its time, from the past alone; without them, a row is seen as it is"""

IDENTITY = pl.Schema({"identity": pl.Int64})
"""Key of the physical vehicle: the same in all recordings that show it; without it, every recording has its own"""

KIND = pl.Schema({"kind": pl.Int8})
"""Number of the vehicle's class in `coverdrive.recordings.files.kinds.KINDS`; without it, unknown"""

STATED_SPEED = pl.Schema({"stated": pl.List(pl.Float32)})
"""Speeds [m/s] as the file states them in its rows from this one's time on and before the next one's, which copies of a
vehicle have in common; NaN where a row was filled in; without it, the speed"""

_WHOLE = pl.Schema(SCHEMA | SEEN | IDENTITY | KIND | STATED_SPEED)

_PAIRS = 2**16
"""of slots of moments that are looked at at once"""

_SCENE = dict(zip(MEASURES, (*SEEN, *MEASURES[4:]), strict=True))
"""The column of every field of a scene"""


def vehicle_keys(recording: str, vehicle: Int[np.ndarray, " rows"]) -> Int[np.ndarray, " rows"]:
    """Keys of the vehicles of a recording: the same whenever it is read, and unique over all recordings."""
    distinct, inverse = np.unique(vehicle, return_inverse=True)
    digests = (hashlib.blake2b(f"{recording}/{number}".encode(), digest_size=8).digest() for number in distinct)
    keys = np.array([int.from_bytes(digest, "big") >> 1 for digest in digests], dtype=np.int64)
    return keys[inverse]


def each_alone(speed: pl.Series) -> pl.Series:
    """A list of its own for each stated speed [m/s]: those of a file with as many rows as the table."""
    return speed.cast(pl.Float32).reshape((-1, 1)).cast(pl.List(pl.Float32))


@dataclass(frozen=True)
class Frames:
    """All moments of a recording at once; a vehicle keeps its slot only within a frame."""

    time: Float[np.ndarray, " F"]
    """[s] ascending"""
    vehicle: Int[np.ndarray, "F A"]
    """vehicle in every slot, −1 where the slot is empty"""
    scene: Scene
    """all measures in float32, with leading axis F; empty slots are zero and not valid"""
    frame: Int[np.ndarray, " rows"]
    slot: Int[np.ndarray, " rows"]
    """where every row of the recording's table is"""

    def every(self, step: int) -> Iterator[tuple[Scene, Int[np.ndarray, "m A"]]]:
        """Every so many moments, m at once: their scene, with leading axis m, and the vehicle in every slot."""
        reach = step * max(1, _PAIRS // self.vehicle.shape[1] ** 2)
        for first in range(0, len(self.time), reach):
            chosen = slice(first, first + reach, step)
            yield jax.tree.map(lambda each, chosen=chosen: each[chosen], self.scene), self.vehicle[chosen]


@dataclass(frozen=True, eq=False)
class Recording:
    """Tracks of vehicles on one road; one that cannot be traffic (`coverdrive.recordings.checks`) is a `DataError`."""

    name: str
    """what it is called in reports, from the file's name"""
    table: pl.DataFrame
    """columns vehicle, group, time [s], lon, lat [m], speed [m/s], heading [rad], length, width [m] as in
    `SCHEMA`, speeds as driven and headings relative to the road; then those of `SEEN`, `IDENTITY`, `KIND` and
    `STATED_SPEED`, which are added if not given; sorted by vehicle and time; times are whole multiples of ``dt``; no
    vehicle has a gap within a group"""
    dt: float
    """[s] between two rows of a track"""
    road: Road
    """its right edge is at lat = 0"""
    repairs: dict[str, int]
    """how often each kind of repair was made when the recording was read"""
    notes: dict[str, str] = field(default_factory=dict[str, str])
    """how it was read: the ``format``, where the ``lanes`` are from, how it was ``resampled``, and which files of its
    folder were ``skipped``"""
    call: str = field(default="", repr=False)
    """which call read it; groups are numbered through those of one call"""
    file_dt: float = 0.0
    """[s] between two rows of a track in the file, whose stated speeds the table holds; 0 stands for ``dt``"""

    def __post_init__(self) -> None:
        """Refuse a table of other columns or types, and one that cannot be traffic."""
        object.__setattr__(self, "file_dt", self.file_dt or self.dt)
        given = {name: kind for name, kind in _WHOLE.items() if name in SCHEMA or name in self.table.columns}
        if self.table.schema != given:
            raise DataError(f"the table of a recording has the columns {dict(SCHEMA)}; got {dict(self.table.schema)}")
        try:
            check(self.table, self.dt, self.road)
            for problem in wrong_time_step("the file's time step", self.file_dt):
                raise DataError(problem)
        except DataError as error:
            raise DataError(f"recording {self.name}: {error}") from None
        if given != _WHOLE:
            keys = vehicle_keys(self.name, self.table["vehicle"].to_numpy())
            added = {name: self.table[name.removeprefix("seen_")] for name in SEEN}
            added |= {"identity": pl.Series(keys, dtype=pl.Int64), "kind": pl.zeros(len(keys), pl.Int8, eager=True)}
            added |= {"stated": each_alone(self.table["speed"])}
            missing = {name: values for name, values in added.items() if name not in given}
            object.__setattr__(self, "table", self.table.with_columns(**missing).select(_WHOLE.names()))

    @cached_property
    def _moment(self) -> Int[np.ndarray, " rows"]:
        """Time of every row in units of dt."""
        return np.rint(self.table["time"].to_numpy() / self.dt).astype(np.int64)

    def scene_at(self, time: float) -> Scene:
        """The A vehicles present at a time [s] from the first to the last row, rounded to the time grid, as seen.

        Raises:
            SettingError, DataError: the time is no number, or before the first row or after the last one.
        """
        moment = round(finite("time", time) / self.dt)
        first, last = int(self._moment.min()), int(self._moment.max())
        if not first <= moment <= last:
            lasts = f"{self.name} lasts from {first * self.dt:g} s to {last * self.dt:g} s"
            raise DataError(f"{lasts}; got the time {time:g} s, choose one between them")
        present = self.rates.filter(pl.Series(self._moment == moment))
        values = {name: present[column].to_numpy() for name, column in _SCENE.items()}
        return Scene(**values, valid=np.ones(len(present), dtype=bool))

    @cached_property
    def rates(self) -> pl.DataFrame:
        """The table with speed and heading of the rates of lon and lat, in which scenes are."""
        table = self.table
        for kind in ("", "seen_") if self.road.line is not None else ():
            rates = self.road.rates(*(self.table[kind + name].to_numpy() for name in MEASURES[:4]))
            table = table.with_columns(pl.Series(kind + "speed", rates[0]), pl.Series(kind + "heading", rates[1]))
        return table

    def stated_rows(self) -> pl.DataFrame:
        """A row for each speed that the file states, with its ``moment`` [file_dt] and the ``row`` of the table."""
        first = (pl.col("time") / self.file_dt - 1e-6).ceil().cast(pl.Int64)
        moments = pl.int_ranges(first, first + pl.col("stated").list.len())
        table = self.table.with_row_index("row").with_columns(moment=moments).filter(pl.col("stated").list.len() > 0)
        return table.explode("stated", "moment")

    def frames(self) -> Frames:
        """All moments of the recording, as seen then, in arrays for vectorised work."""
        moments, frame = np.unique(self._moment, return_inverse=True)
        slot = pl.DataFrame({"frame": frame}).select(pl.int_range(pl.len()).over("frame")).to_series().to_numpy()
        shape = (len(moments), int(slot.max()) + 1)

        vehicle = np.full(shape, -1, dtype=np.int64)
        vehicle[frame, slot] = self.table["vehicle"].to_numpy()
        values: dict[str, np.ndarray] = {}
        for name, column in _SCENE.items():
            values[name] = np.zeros(shape, dtype=np.float32)
            values[name][frame, slot] = self.rates[column].to_numpy()
        scene = Scene(**values, valid=vehicle >= 0)
        return Frames(moments * self.dt, vehicle, scene, frame, slot)
