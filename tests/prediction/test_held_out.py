import numpy as np
import pytest

from coverdrive.errors import DataError
from coverdrive.prediction.basis import BasisSettings
from coverdrive.prediction.calibrate import CertificateSettings
from coverdrive.prediction.fit import Fit, PredictionSettings, fit
from coverdrive.prediction.held_out import held_out
from coverdrive.prediction.training import TrainingSettings
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.generated import GeneratedSettings, generate

SETTINGS = PredictionSettings(
    basis=BasisSettings(epsilon=1.0),
    training=TrainingSettings(epochs=1),
    certificate=CertificateSettings(confidence=0.9, unit="window"),
)


@pytest.fixture(scope="module")
def fitted(scenes: tuple[Recording, ...]) -> Fit:
    return fit(scenes, SETTINGS, seed=1)


def test_only_the_groups_of_the_test_split_are_left(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    kept = held_out(fitted.predictor, scenes, SETTINGS, seed=1)
    groups = {int(group) for recording in kept for group in recording.table["group"].unique()}
    assert groups == set(fitted.segments.group[fitted.split.test].tolist())
    made_from = np.concatenate([fitted.split.train, fitted.split.calibration])
    assert not groups & set(fitted.segments.group[made_from].tolist())


def test_another_split_or_a_part_of_the_recordings_is_refused(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    for recordings, seed in ((scenes, 2), (scenes[:5], 1)):
        with pytest.raises(DataError, match="no scene of them is known to be new"):
            held_out(fitted.predictor, recordings, SETTINGS, seed)


def test_recordings_that_it_never_saw_are_kept_whole(fitted: Fit) -> None:
    new = generate(GeneratedSettings(scenes=3, duration=5.0, vehicles=(4, 5)), seed=9)
    assert held_out(fitted.predictor, new, SETTINGS, seed=1) == new
