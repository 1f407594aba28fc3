"""Recordings at another time step.

Tracks were smoothed at the rate of the file's frames (`coverdrive.recordings.tracks.smoothing`); that fit is the
low-pass filter. Between two frames a vehicle is on the cubic that has both their positions and velocities (Hermite).
What is seen of it comes from the last frame before: the filter's position moved on by its velocity, so that nothing of
the future shows. R is the number of rows.
"""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.arguments import finite
from coverdrive.errors import SettingError
from coverdrive.recordings.checks import TIME_STEPS
from coverdrive.recordings.recording import MEASURES, Recording
from coverdrive.recordings.tracks.reading import drop_implausible
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road

STEP = 0.1
"""[s] the usual time step of recordings"""

SAME = 1e-9
"""[s] time steps that differ by less are the same"""

Rows = Float[np.ndarray, " R"]


def check_step(dt: float) -> None:
    """Refuse a time step [s] that no recording of traffic has."""
    if not TIME_STEPS[0] <= finite("dt", dt) <= TIME_STEPS[1]:
        raise SettingError(f"the time step is {dt:g} s; expected {TIME_STEPS[0]} to {TIME_STEPS[1]:g} s")


def resampled(recording: Recording, dt: float, settings: SmoothingSettings) -> Recording:
    """The recording with a row of every vehicle at each multiple of ``dt`` [s]; itself if it has this step.

    Its note ``resampled`` says from which rate and through which filter. Vehicles that move as none does in the new
    rows alone are left out, as `drop_implausible` counts them. A DataError if they are many, or none has a row.
    """
    check_step(dt)
    if abs(recording.dt - dt) < SAME:
        return recording
    table = recording.table
    column = {name: table[name].to_numpy() for name in table.columns if name != "stated"}
    time, last = column["time"], len(table) - 1
    goes_on = (np.diff(column["vehicle"]) == 0) & (np.diff(time) < 1.5 * recording.dt)
    starts = np.flatnonzero(np.insert(~goes_on, 0, True))
    ends = np.append(starts[1:] - 1, last)
    first = np.ceil(time[starts] / dt - 1e-6).astype(np.int64)
    count = np.maximum(np.floor(time[ends] / dt + 1e-6).astype(np.int64) - first + 1, 0)
    track = np.repeat(np.arange(len(starts)), count)
    moment = (first - np.cumsum(count) + count)[track] + np.arange(len(track))
    since = moment * dt - time[starts[track]]
    step = np.clip(np.floor(since / recording.dt + 1e-6).astype(np.int64), 0, (ends - starts)[track])
    before = starts[track] + step
    after = np.minimum(before + 1, ends[track])
    past = since - step * recording.dt

    values: dict[str, Any] = {name: of[before] for name, of in column.items()} | {"time": moment * dt}
    values["stated"] = _stated(recording, dt, starts, first, count)
    rates, seen = (_rates(recording.road, *(column[kind + name] for name in MEASURES[:4])) for kind in ("", "seen_"))
    for place, rate, seen_rate in zip(("lon", "lat"), rates, seen, strict=True):
        at = column[place]
        values[place] = _hermite(at[before], at[after], rate[before], rate[after], past, recording.dt)
        values[f"seen_{place}"] = column[f"seen_{place}"][before] + past * seen_rate[before]
    share = past / recording.dt
    along, across = (1 - share) * rates[:, before] + share * rates[:, after]
    along = along * recording.road.stretch(values["lon"], values["lat"])
    values["speed"], values["heading"] = np.hypot(along, across), np.arctan2(across, along)
    fit = f"Savitzky–Golay fit of {settings.window:g} s, order {settings.order}"
    notes = recording.notes | {"resampled": f"{1 / recording.dt:g} Hz to {1 / dt:g} Hz after the {fit}"}
    moved, repairs = pl.DataFrame(values, schema=table.schema), Counter(recording.repairs)
    if len(moved):
        moved = drop_implausible(moved, dt, recording.road, repairs)
    return replace(recording, table=moved, dt=dt, repairs=dict(+repairs), notes=notes)


def _stated(
    recording: Recording, dt: float, starts: Int[np.ndarray, " tracks"], first: Int[np.ndarray, " tracks"],
    count: Int[np.ndarray, " tracks"],
) -> pl.Series:  # fmt: skip
    """What the file states from each new row on; each track has ``count`` of them, from ``first`` [dt] on."""
    rows = recording.stated_rows()
    track = np.searchsorted(starts, rows["row"].to_numpy(), side="right") - 1
    since = np.floor(rows["moment"].to_numpy() * recording.file_dt / dt + 1e-6).astype(np.int64) - first[track]
    row = np.where((since >= 0) & (since < count[track]), (np.cumsum(count) - count)[track] + since, -1)
    lists = rows.select("stated", row=pl.Series(row)).group_by("row", maintain_order=True).agg("stated")
    return pl.DataFrame({"row": np.arange(count.sum())}).join(lists, on="row", how="left")["stated"].fill_null([])


def _rates(road: Road, lon: Rows, lat: Rows, speed: Rows, heading: Rows) -> Float[np.ndarray, "2 R"]:
    """Rates of lon and lat [m/s]."""
    return speed * np.stack([np.cos(heading) / road.stretch(lon, lat), np.sin(heading)])


def _hermite(before: Rows, after: Rows, rate: Rows, rate_after: Rows, past: Rows, dt: float) -> Rows:
    """The cubic through two positions [m] with two rates [m/s], ``past`` [s] after the first."""
    s = past / dt
    return (
        (1 + 2 * s) * (1 - s) ** 2 * before
        + s**2 * (3 - 2 * s) * after
        + dt * s * (1 - s) * ((1 - s) * rate - s * rate_after)
    )
