"""Smoothing: exact on polynomials, equal to SciPy's filter, and better than the noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from coverdrive.recordings.tracks import smoothing
from coverdrive.recordings.tracks.smoothing import SmoothingSettings, motion, smooth

SETTINGS = SmoothingSettings()


@pytest.mark.parametrize(("dt", "samples"), [(0.1, 17), (0.04, 43), (0.2, 9), (0.5, 5), (1.0, 5)])
def test_window_is_an_odd_number_of_samples(dt: float, samples: int):
    assert SETTINGS.samples(dt) == samples


@given(st.lists(st.integers(7, 60), min_size=1, max_size=6), st.integers(0, 2**32 - 1))
def test_cubic_tracks_are_kept_exactly(lengths: list[int], seed: int):
    coefficients = np.random.default_rng(seed).normal(size=(len(lengths), 4)) * [20, 5, 0.5, 0.05]
    times = [0.1 * np.arange(length) for length in lengths]
    values = np.concatenate([np.polyval(c[::-1], t) for c, t in zip(coefficients, times, strict=True)])
    slopes = np.concatenate([np.polyval(np.polyder(c[::-1]), t) for c, t in zip(coefficients, times, strict=True)])
    starts = np.cumsum([0, *lengths[:-1]])
    smoothed, slope = smooth(values, starts, 0.1, SETTINGS)
    assert smoothed == pytest.approx(values, abs=1e-6)
    assert slope == pytest.approx(slopes, abs=1e-6)


def test_long_tracks_are_filtered_as_by_scipy_one_by_one():
    random = np.random.default_rng(0)
    lengths = [17, 40, 18, 100]
    tracks = [np.cumsum(random.normal(1, 0.3, length)) for length in lengths]
    smoothed, slope = smooth(np.concatenate(tracks), np.cumsum([0, *lengths[:-1]]), 0.1, SETTINGS)
    assert smoothed == pytest.approx(np.concatenate([savgol_filter(track, 17, 3) for track in tracks]))
    expected = np.concatenate([savgol_filter(track, 17, 3, deriv=1, delta=0.1) for track in tracks])
    assert slope == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("length", range(2, 17))
def test_short_tracks_keep_straight_lines_and_leave_their_neighbours_alone(length: int):
    before, line, after = np.full(30, 7.0), 3.0 + 2.0 * 0.1 * np.arange(length), np.full(30, -9.0)
    starts = np.array([0, 30, 30 + length])
    smoothed, slope = smooth(np.concatenate([before, line, after]), starts, 0.1, SETTINGS)
    assert smoothed == pytest.approx(np.concatenate([before, line, after]))
    assert slope == pytest.approx(np.concatenate([np.zeros(30), np.full(length, 2.0), np.zeros(30)]), abs=1e-9)


def test_noise_of_differences_is_reduced_manyfold():
    random = np.random.default_rng(1)
    time = 0.1 * np.arange(600)
    truth = 20 * time + 5 * np.sin(time / 2)
    noisy = truth + random.normal(0, 0.2, len(time))
    _, slope = smooth(noisy, np.array([0]), 0.1, SETTINGS)
    speed = 20 + 2.5 * np.cos(time / 2)
    raw_error = np.std(np.gradient(noisy, 0.1) - speed)
    assert np.std(slope - speed) < raw_error / 4


def test_heading_is_zero_where_a_vehicle_stands(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(smoothing, "SLOW", 0.0)
    speed, heading = motion(np.array([0.5, -0.3, 10.0, 3.0]), np.array([0.5, 0.0, 1.0, -4.0]))
    assert speed == pytest.approx([np.sqrt(0.5), 0.3, np.sqrt(101), 5.0])
    assert heading == pytest.approx([0.0, 0.0, np.arctan(0.1), np.arctan2(-4, 3)])


@pytest.mark.parametrize(("lon_rate", "most"), [(1.5, 0.6), (3.0, 0.8), (12.0, 1.0)])
def test_heading_of_a_slow_vehicle_is_less_than_its_direction_of_motion(lon_rate: float, most: float):
    random, count, noise = np.random.default_rng(2), 100_000, 0.1 / lon_rate
    true = random.normal(0, 0.035, count)
    rates = np.full(count, lon_rate), lon_rate * np.tan(true) + random.normal(0, 0.1, count)
    error, plain = np.std(motion(*rates)[1] - true), np.std(np.arctan2(rates[1], rates[0]) - true)
    assert error == pytest.approx(0.035 * noise / np.hypot(0.035, noise), rel=0.03)
    assert error < most * plain


def test_heading_of_a_vehicle_that_goes_backwards_is_backwards():
    assert motion(np.array([-12.0]), np.array([0.0]))[1] == pytest.approx(np.pi)
