"""Windows and vehicles as units, by hand and against a slow loop."""

import numpy as np
import pytest
from certificates_fakes import make_units
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.certificates.calibration import Calibration, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError
from shape_checks import unchecked

TUBE = 0.5


def three_windows() -> ScoredSamples:
    """Vehicle 7 drives base 0 twice, vehicle 3 drives base 1 and leaves the tube there."""
    return ScoredSamples(
        np.array([[0.9, 0.1], [0.6, 0.3], [0.2, 0.7]]),
        np.array([0, 0, 1]),
        np.array([0.1, 0.5, 0.6]),
        np.array([7, 7, 3]),
    )


def random_samples(seed: int) -> ScoredSamples:
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 40))
    return ScoredSamples(
        random.random((count, 3)), random.integers(0, 3, count), random.random(count), random.integers(0, 6, count)
    )


def test_windows_by_hand() -> None:
    units = make_units(three_windows(), TUBE, "window")
    assert units.demands.score.tolist() == [0.9, 0.6, -np.inf]
    assert units.demands.base.tolist() == [0, 0, 1]
    assert units.covered.tolist() == [True, True, False]


def test_vehicles_by_hand() -> None:
    units = make_units(three_windows(), TUBE, "vehicle")
    assert units.demands.unit.tolist() == [0, 1]  # vehicle 3, then vehicle 7
    assert units.demands.score.tolist() == [-np.inf, 0.6]
    assert units.missed(Thresholds(np.array([0.6, 0.0]), np.full(2, TUBE))).tolist() == [True, False]
    assert units.missed(Thresholds(np.array([0.7, 0.0]), np.full(2, TUBE))).tolist() == [True, True]


@given(st.integers(0, 10_000), st.sampled_from(["window", "vehicle"]))
def test_missed_units_are_those_of_a_slow_loop(seed: int, unit: Unit) -> None:
    samples = random_samples(seed)
    rule = Thresholds(np.random.default_rng(seed + 1).random(3), np.full(3, TUBE))
    missed: dict[int, bool] = {}
    for row in range(len(samples)):
        key = int(samples.vehicle[row]) if unit == "vehicle" else row
        base = samples.base[row]
        miss = bool(samples.distance[row] > TUBE or samples.scores[row, base] < rule.values[base])
        missed[key] = missed.get(key, False) or miss
    units = make_units(samples, TUBE, unit)
    assert units.missed(rule).tolist() == [missed[key] for key in sorted(missed)]


def test_units_that_are_none_are_refused() -> None:
    with (
        unchecked(),
        pytest.raises(CertificateError, match=r"unit: expected 'window' or 'vehicle' or .*, got 'windows'"),
    ):
        Calibration.of(three_windows(), TUBE, np.array([0]), unit="windows")  # pyright: ignore[reportArgumentType]


def test_training_vehicles_are_refused() -> None:
    with pytest.raises(CertificateError, match="1 of 2 calibration vehicles also trained"):
        Calibration.of(three_windows(), TUBE, np.array([3]))
