"""Times that files round are read at the rate of their frames, or refused."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from published_formats import found_again, truth, write_tgsim

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.times import moments_of, time_step
from coverdrive.recordings.read import read

FILE = Path("tracks.csv")


def rows(clock: np.ndarray, vehicles: int = 20, length: int = 120) -> pl.DataFrame:
    """Vehicles one after the other, each in so many rows, the clock once from its start to its end."""
    first = np.linspace(0, len(clock) - length, vehicles).astype(int)
    frame = (first[:, None] + np.arange(length)).ravel()
    return pl.DataFrame({"vehicle": np.repeat(np.arange(vehicles), length), "frame": frame, "clock": clock[frame]})


@pytest.mark.parametrize("digits", [2, 3, 6])
@pytest.mark.parametrize("rate", [2, 10, 12.5, 15, 24, 25, 29.97, 30, 30.5, 48, 50])
@pytest.mark.parametrize("start", [0.0, 1.7e9 + 0.0123])
def test_rounded_times_have_the_rate_of_their_frames(rate: float, digits: int, start: float):
    """Also over ten minutes, in which vehicles are far between."""
    for count, vehicles in ((130, 5), (int(600 * rate), 40)):
        real = np.arange(count) / rate
        table = rows((start + real).round(digits), vehicles).sample(fraction=0.8, seed=1)
        dt = time_step(FILE, table, "times are in seconds")
        assert abs(dt * rate - 1) * count < 0.1 and (dt == 1 / rate or rate % 1)
        clock = table["clock"].to_numpy()
        frame = table["frame"].to_numpy()
        assert np.ptp(moments_of(FILE, clock, dt) - frame) == 0


def test_a_step_of_whole_milliseconds_is_what_it_says():
    assert time_step(FILE, rows(np.arange(2000) * 33 / 1000), "times are in seconds") == 0.033


def test_rates_that_no_traffic_is_recorded_at_are_named():
    with pytest.raises(RecordingError, match=r"is 0\.0166667 s; expected 0\.02 to 1 s .*keep one in 2 of the rows"):
        time_step(FILE, rows((np.arange(500) / 60).round(2)), "times are in seconds")


def test_times_without_a_rate_are_refused():
    clock = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.06, 1000))
    table = rows(clock)
    dt = time_step(FILE, table, "times are in seconds")
    with pytest.raises(RecordingError, match=r"not multiples of 0\.04\d* s apart; expected one frame rate"):
        moments_of(FILE, table["clock"].to_numpy(), dt)


@pytest.mark.parametrize("rate", [15, 29.97, 30])
def test_a_file_of_hundredths_is_read(rate: float, tmp_path: Path):
    real = truth(1 / rate, carriageways=1, seconds=6.0)
    (found,) = read(write_tgsim(tmp_path, [real]))
    worst = found_again(found, real.tables[0], shift=1e5)
    assert found.repairs == {} and float(found.notes["resampled"].split()[0]) == pytest.approx(rate, rel=3e-4)
    assert worst["speed"] < 0.2 and worst["lat"] < 0.1


def test_times_that_are_rounded_to_less_than_frames_are_refused(tmp_path: Path):
    path = write_tgsim(tmp_path, [truth(1 / 30, carriageways=1, seconds=5.0)], time=pl.col("time").round(1))
    with pytest.raises(RecordingError, match=r"row \d+: vehicle \d+ is at two places at .* s, .*to the millisecond"):
        read(path)
