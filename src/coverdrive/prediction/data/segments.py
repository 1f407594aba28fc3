"""Trajectory segments: what vehicles did in the three seconds after a moment (paper §2.1).

A segment is stored as its *deviation from constant velocity* (paper, Remark 1): with v₀ the speed along the road at
its start, point t is (lon(t) − lon(0) − v₀·t, lat(t) − lat(0)). The start is where, and as fast as, the vehicle is
*seen* then, from its past alone; where it goes is smoothed both ways. N segments of T = 7 points.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field, model_validator

from coverdrive.errors import DataError, SettingError
from coverdrive.recordings.recording import Recording
from coverdrive.settings import Settings

MIRROR = np.array([1.0, -1.0])
"""times a point or a deviation (lon, lat): its mirror image, left for right"""

WATCHED = 0.1
"""[s] between two moments at which a body has to be in its box"""

_MOST_POINTS = 200

_ROUNDING = 1e-6
"""of a number of time steps"""


class SegmentSettings(Settings):
    """How recordings are cut into segments."""

    horizon: float = Field(default=3.0, ge=0.1, le=60)
    """[s] length of a segment (paper §2.1)"""
    step: float = Field(default=0.5, ge=0.01, le=60)
    """[s] between two points of a segment (authors' scripts)"""
    stride: float = Field(default=0.2, ge=0.01, le=3600)
    """[s] between the starts of two segments of one vehicle; overlapping segments are strongly dependent"""

    @model_validator(mode="after")
    def _has_few_points(self) -> "SegmentSettings":
        if not 2 <= self.points <= _MOST_POINTS:
            raise ValueError(
                f"a segment of {self.horizon:g} s has {self.points} points every {self.step:g} s; expected 2 to "
                f"{_MOST_POINTS}"
            )
        return self

    @property
    def points(self) -> int:
        """Number of points T of a segment."""
        return round(self.horizon / self.step) + 1


@dataclass(frozen=True)
class Segments:
    """N segments, with keys back to where they came from."""

    points: Float[np.ndarray, "N T 2"]
    """[m] deviation from constant velocity along lon and lat; the first point is zero"""
    speed: Float[np.ndarray, " N"]
    """[m/s] along the road at the start, as seen there"""
    heading: Float[np.ndarray, "N T"]
    """[rad] at the points"""
    half_sizes: Float[np.ndarray, "N 2"]
    """[m] half length and half width of the vehicle"""
    step: float
    """[s] between two points"""
    vehicle: Int[np.ndarray, " N"]
    """key of the physical vehicle, one in all recordings that show it, and the same whenever they are read"""
    group: Int[np.ndarray, " N"]
    """group of scenes that may share vehicles"""
    recording: Int[np.ndarray, " N"]
    """index of the recording"""
    row: Int[np.ndarray, " N"]
    """row of the start in the recording's table"""

    def __len__(self) -> int:
        """Number of segments N."""
        return self.points.shape[0]

    @property
    def mirrored(self) -> "Segments":
        """The mirror images, left for right."""
        return replace(self, points=self.points * MIRROR, heading=-self.heading)

    def of(self, keep: np.ndarray | slice) -> "Segments":
        """The segments selected by an index or boolean array, or by a slice."""
        return replace(self, **{name: getattr(self, name)[keep] for name in _PER_SEGMENT})


def cut_segments(recordings: Sequence[Recording], settings: SegmentSettings | None = None) -> Segments:
    """Cut every track of every recording, on a uniform time grid, into overlapping segments.

    A step or stride that is no multiple of the time step is a `SettingError`, and no track as long as the horizon a
    `DataError`.
    """
    settings = settings or SegmentSettings()
    parts = [_cut(recording, index, settings) for index, recording in enumerate(recordings)]
    total = sum(len(part) for part in parts)
    if total == 0:
        raise DataError(
            f"no vehicle in {len(recordings)} recordings was seen for {settings.horizon} s without a gap; "
            "give longer recordings or a shorter horizon"
        )
    joined = (np.concatenate([getattr(part, name) for part in parts]) for name in _PER_SEGMENT)
    return Segments(step=settings.step, **dict(zip(_PER_SEGMENT, joined, strict=True)))


_PER_SEGMENT = ("points", "speed", "heading", "half_sizes", "vehicle", "group", "recording", "row")


def watched(recordings: Sequence[Recording], segments: Segments) -> Segments:
    """Segments of recordings with points at all moments at which bodies are watched.

    They are 0.1 s apart, or more where a recording has a longer time step; where that does not go into all time steps
    and the step of the segments, bodies are watched at the points alone.
    """
    every = max((recording.dt * max(1, round(WATCHED / recording.dt)) for recording in recordings), default=0.0)
    ratios = [segments.step / every, *(every / recording.dt for recording in recordings)] if recordings else [0.0]
    if len(segments) == 0 or not all(abs(each - round(each)) < _ROUNDING and each > 0.5 for each in ratios):
        return segments
    moments = round(segments.step / every) * (segments.points.shape[1] - 1) + 1
    points, heading = np.empty((len(segments), moments, 2)), np.empty((len(segments), moments))
    for index in np.unique(segments.recording):
        own, recording = segments.recording == index, recordings[index]
        rows = segments.row[own, None] + round(every / recording.dt) * np.arange(moments)
        points[own], heading[own], _ = _seen_from_starts(recording, rows, every * np.arange(moments))
    return replace(segments, points=points, heading=heading, step=every)


def _cut(recording: Recording, index: int, settings: SegmentSettings) -> Segments:
    step = _samples(settings.step, recording, "step")
    stride = _samples(settings.stride, recording, "stride")
    reach = step * (settings.points - 1)
    table = recording.rates
    column = {name: table[name].to_numpy() for name in table.columns}
    vehicle = column["vehicle"]
    first = np.flatnonzero(np.r_[True, vehicle[1:] != vehicle[:-1]][: len(vehicle)])
    since_first = np.arange(len(vehicle)) - np.repeat(first, np.diff(np.r_[first, len(vehicle)]))
    starts = np.flatnonzero(since_first[: max(len(vehicle) - reach, 0)] % stride == 0)
    starts = starts[vehicle[starts] == vehicle[starts + reach]]
    rows = starts[:, None] + step * np.arange(settings.points)
    points, heading, speed = _seen_from_starts(recording, rows, settings.step * np.arange(settings.points))
    return Segments(
        points=points,
        speed=speed,
        heading=heading,
        half_sizes=np.stack([column["length"][starts], column["width"][starts]], axis=-1) / 2,
        step=settings.step,
        vehicle=column["identity"][starts],
        group=column["group"][starts],
        recording=np.full(len(starts), index),
        row=starts,
    )


def _seen_from_starts(
    recording: Recording, rows: Int[np.ndarray, "N K"], elapsed: Float[np.ndarray, " K"]
) -> tuple[Float[np.ndarray, "N K 2"], Float[np.ndarray, "N K"], Float[np.ndarray, " N"]]:
    """Deviations [m], headings [rad] and the speed at the start [m/s] of segments, from the rows of their points."""
    names = ("seen_speed", "seen_heading", "seen_lon", "seen_lat", "lon", "lat", "heading")
    column, starts = {name: recording.rates[name].to_numpy() for name in names}, rows[:, 0]
    speed = column["seen_speed"][starts] * np.cos(column["seen_heading"][starts])
    lon = column["lon"][rows] - column["seen_lon"][starts, None] - speed[:, None] * elapsed
    lat = column["lat"][rows] - column["seen_lat"][starts, None]
    return np.stack([lon, lat], axis=-1) * (elapsed > 0)[:, None], column["heading"][rows], speed


def _samples(duration: float, recording: Recording, name: str) -> int:
    count = round(duration / recording.dt)
    if count < 1 or abs(count * recording.dt - duration) > 1e-6:
        raise SettingError(
            f"the segment {name} must be a multiple of the time step {recording.dt} s of recording "
            f"{recording.name!r}, got {duration} s: resample the recording to 0.1 s, or choose a multiple"
        )
    return count
