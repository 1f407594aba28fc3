"""Small recordings for the prediction tests, which may import the fakes of recordings and simulation, too."""

import sys
from pathlib import Path

import numpy as np
import pytest

from coverdrive.prediction.fit import Fit, fit
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
