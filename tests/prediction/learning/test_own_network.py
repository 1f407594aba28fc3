"""A network that is any function of arrays: fitted, certified, tested, driven with."""

from pathlib import Path

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner

from coverdrive.errors import DataError, SettingError
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.cover.basis import BasisSettings
from coverdrive.prediction.data.segments import SegmentSettings
from coverdrive.prediction.fit import Fit, PredictionSettings, fit
from coverdrive.prediction.fits.calibrations import certify
from coverdrive.prediction.learning.own_network import OwnNetwork
from coverdrive.prediction.learning.samples import Samples
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.traffic.driver_traffic import DriverTraffic

SETTINGS = PredictionSettings(
    segments=SegmentSettings(stride=0.5),
    basis=BasisSettings(radius=1.0),
    certificate=CertificateSettings(confidence=0.9, unit="window"),
)


def least_squares(samples: Samples):
    """Scores by one linear layer, in plain NumPy."""
    seen = np.c_[samples.features, np.ones(len(samples))]
    driven = np.eye(samples.labels.shape[1])[samples.base]
    weights = np.linalg.lstsq(seen, driven, rcond=None)[0]

    def scores(features: np.ndarray) -> np.ndarray:
        return np.clip(np.c_[features, np.ones(len(features))] @ weights, 0, 1)

    return scores


@pytest.fixture(scope="module")
def fitted(scenes: tuple[Recording, ...]) -> Fit:
    return fit(scenes, SETTINGS, seed=1, learner=least_squares)


def test_it_sees_the_21_features_of_the_training_side_only(scenes: tuple[Recording, ...], fitted: Fit) -> None:
    lessons: list[Samples] = []

    def keep(samples: Samples):
        lessons.append(samples)
        return least_squares(samples)

    again = fit(scenes, SETTINGS, seed=1, learner=keep)
    assert lessons[0].features.shape[1] == 21
    assert set(lessons[0].vehicle) == set(again.predictor.trained_on)
    assert again.predictor.fingerprint == fitted.predictor.fingerprint


def test_it_is_certified_and_keeps_its_bound(fitted: Fit) -> None:
    certificate = fitted.predictor.certificate
    assert (certificate.epsilon, certificate.confidence, certificate.unit) == (0.1, 0.9, "window")
    assert fitted.evaluation.windows.value <= 0.15
    compared = certify(fitted, targets=[0.2], unit="window")
    proved = {each.method.value for each in compared if each.certificate}
    assert "pac-pooled" in proved and "svm" not in proved
    assert "hidden" in next(each.refusal for each in compared if each.method == "svm")


def test_it_is_asked_in_drives(fitted: Fit) -> None:
    settings = EpisodeSettings(duration=0.5)
    trace = run_episode(fitted.predictor, ConstantPlanner(), DriverTraffic(), settings, vehicles=3, seed=0)
    assert trace.outcome.time == 0.5 and all(len(paths) for paths in trace.paths)


def test_scores_that_are_none_are_refused() -> None:
    features = np.zeros((2, 21), np.float32)
    for wrong in (lambda rows: rows[:, :2], lambda rows: rows[:, :3] - 1, lambda rows: rows[:, :3] * np.nan):
        with pytest.raises(DataError, match=r"must give 2 × 3 scores in \[0, 1\], got an array of shape"):
            OwnNetwork(wrong, "affordance", 3).scores(features)


def test_it_is_kept_by_whoever_made_it(fitted: Fit, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="no file can hold a function"):
        fitted.predictor.save(tmp_path / "predictor.safetensors")
    assert not list(tmp_path.iterdir())
