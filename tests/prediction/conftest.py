"""Small recordings for the prediction tests, which may import the fakes of recordings and simulation, too."""

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from coverdrive.certificates.certificate import Unit
from coverdrive.prediction.boxes.training import BoxSettings
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.data.segments import SegmentSettings
from coverdrive.prediction.fit import Fit, PredictionSettings, fit
from coverdrive.recordings.recording import Recording

sys.path[:0] = [str(Path(__file__).parents[i] / name) for i, name in ((0, ""), (1, "recordings"), (1, "simulation"))]


@pytest.fixture(scope="session")
def scenes() -> tuple[Recording, ...]:
    """Six independent scenes of eight vehicles: some brake, some drift to the left, some keep going."""
    from prediction_fakes import recording_of

    recordings = []
    for group in range(6):
        random = np.random.default_rng(group)
        time = 0.1 * np.arange(81)
        tracks = []
        for number in range(8):
            speed, acceleration = random.uniform(15, 25), random.choice([-2.0, 0.0, 0.5])
            drift = random.choice([0.0, 0.0, 0.6])
            tracks.append(
                {
                    "lon": 40.0 * number + speed * time + acceleration * time**2 / 2,
                    "lat": 1.8 + 3.6 * (number % 3) + drift * np.sin(time / 2),
                    "speed": np.maximum(speed + acceleration * time, 0),
                    "group": group,
                }
            )
        recordings.append(recording_of(tracks, name=f"scene {group}"))
    return tuple(recordings)


@pytest.fixture(scope="session")
def fitted(scenes: tuple[Recording, ...]) -> Fit:
    """The fit to the scenes with the quick settings."""
    from prediction_fakes import SETTINGS

    return fit(scenes, SETTINGS, seed=1)


@pytest.fixture(scope="session")
def boxed(scenes: tuple[Recording, ...]) -> Callable[[Unit], Fit]:
    """The fit of boxes to the scenes for a claim about a unit, made once."""

    @cache
    def made(unit: Unit) -> Fit:
        settings = PredictionSettings(
            segments=SegmentSettings(stride=0.5),
            boxes=BoxSettings(most_steps=150, batch=64, hidden=(16,), members=2),
            certificate=CertificateSettings(epsilon=0.3, confidence=0.8, unit=unit),
        )
        return fit(scenes, settings, seed=1)

    return made
