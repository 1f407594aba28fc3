"""Recordings at another time step."""

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import SettingError
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.tracks.resampling import resampled
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road

SETTINGS = SmoothingSettings()


def weaving(dt: float) -> Recording:
    """Two vehicles with waves of 8 s along and across the road; the second begins at 2.5 s."""
    parts: list[pl.DataFrame] = []
    for vehicle, (begin, end) in enumerate(((0.0, 20.0), (2.5, 17.3))):
        time = np.arange(round(begin / dt), round(end / dt) + 1) * dt
        wave = 2 * np.pi / 8
        rates = np.stack([20 + 2 * np.cos(wave * time), 0.4 * np.cos(wave * time)])
        places = np.stack([20 * time + 2 / wave * np.sin(wave * time), 5 + 0.4 / wave * np.sin(wave * time)])
        columns = {
            "vehicle": np.full(len(time), vehicle),
            "group": (time >= 10).astype(int),
            "time": time,
            "lon": places[0],
            "lat": places[1] + 2.0 * vehicle,
            "speed": np.hypot(*rates),
            "heading": np.arctan2(rates[1], rates[0]),
            "length": np.full(len(time), 4.5),
            "width": np.full(len(time), 1.8),
        }
        parts.append(pl.DataFrame(columns, schema=SCHEMA))
    return Recording("weaving", pl.concat(parts), dt, Road.straight(length=600.0), {"odd lengths": 1}, {"format": "x"})


@pytest.mark.parametrize(("before", "after"), [(0.04, 0.1), (1 / 30, 0.1), (0.1, 0.04), (0.2, 0.1), (0.05, 0.1)])
def test_the_motion_stays(before: float, after: float):
    recording, exact = resampled(weaving(before), after, SETTINGS), weaving(after)
    assert recording.dt == after and recording.repairs == {"odd lengths": 1} and recording.notes["format"] == "x"
    both = recording.table.join(
        exact.table.with_columns(moment=(pl.col("time") / after).round()),
        left_on=["vehicle", (pl.col("time") / after).round()],
        right_on=["vehicle", "moment"],
    )
    assert len(both) >= 0.98 * len(exact.table)
    for name, within in {"lon": 2e-4, "lat": 1e-4, "speed": 0.01, "heading": 5e-4}.items():
        assert both[name].to_numpy() == pytest.approx(both[f"{name}_right"].to_numpy(), abs=within)
    assert recording.table["kind"].dtype == pl.Int8 and recording.table["identity"].n_unique() == 2
    assert set(recording.table.filter(pl.col("time") < 9.9)["group"]) == {0}


@pytest.mark.parametrize(("before", "after"), [(0.04, 0.1), (1 / 30, 0.1), (0.1, 0.04), (0.2, 0.1)])
def test_what_the_file_states_stays(before: float, after: float):
    """But before the first and after the last moment of the new step, also where it is changed once more."""
    recording = weaving(before)
    rows = pl.col("vehicle", "moment", "stated")
    whole = recording.stated_rows().select(rows)
    for found in (
        resampled(recording, after, SETTINGS),
        resampled(resampled(recording, after, SETTINGS), 0.2, SETTINGS),
    ):
        stated = found.stated_rows().select(rows)
        assert found.file_dt == before and len(whole) - 4 * 0.2 / before <= len(stated) == stated.n_unique()
        assert len(stated.join(whole, on=("vehicle", "moment", "stated"))) == len(stated)


def test_what_is_seen_knows_no_future():
    """Everything that happens from 8 s on is changed: nothing that is seen before changes."""
    recording = weaving(0.04)
    late = pl.col("time") > 8.0 - 1e-9
    seen = [name for name in recording.table.columns if name.startswith("seen_")]
    changed = recording.table.with_columns(
        pl.when(late).then(pl.col(name) * 0.999 + 0.01).otherwise(pl.col(name)).alias(name) for name in seen
    )
    other = Recording("weaving", changed, 0.04, recording.road, {})
    one, two = (resampled(each, 0.1, SETTINGS).table.filter(pl.col("time") < 7.95) for each in (recording, other))
    assert one.equals(two) and len(one) > 100


def test_a_recording_of_this_step_is_itself():
    recording = weaving(0.1)
    assert resampled(recording, 0.1, SETTINGS) is recording
    with pytest.raises(SettingError, match="the time step is 5 s; expected"):
        resampled(recording, 5.0, SETTINGS)


def test_tracks_are_not_joined():
    """A vehicle that is away for a while, in another group."""
    recording = weaving(0.04)
    table = recording.table.filter(~pl.col("time").is_between(9.0, 10.0 - 1e-9))
    found = resampled(Recording("gap", table, 0.04, recording.road, {}), 0.1, SETTINGS).table
    assert found.filter(pl.col("time").is_between(9.05, 9.95)).is_empty()
    assert set(found["group"]) == {0, 1}
