"""What a fit leaves behind for its pictures."""

from pathlib import Path

import numpy as np
import pytest

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.errors import DataError
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.fits.learned import Learned, score_histograms


def test_every_calibration_window_is_counted(fitted: Fit) -> None:
    learned = Learned.of(fitted)
    calibration, bases = len(fitted.split.calibration), len(fitted.predictor.basis)
    assert learned.driven.sum() == calibration
    assert learned.others.sum() == calibration * (bases - 1)
    assert learned.set_sizes.sum() == len(fitted.split.test)
    mean = learned.set_sizes @ np.arange(bases + 1) / learned.set_sizes.sum()
    assert mean == pytest.approx(fitted.evaluation.mean_set_size)


def test_examples_are_covered_by_their_base(fitted: Fit) -> None:
    basis = fitted.predictor.basis
    distance = basis.distance(Learned.of(fitted).examples)
    assert (np.diag(distance) <= basis.radius).all()


def test_file_holds_the_same(fitted: Fit, tmp_path: Path) -> None:
    learned = Learned.of(fitted)
    learned.save(tmp_path / "learned.safetensors")
    again = Learned.load(tmp_path / "learned.safetensors")
    assert all(np.array_equal(getattr(again, name), values) for name, values in vars(learned).items())
    (tmp_path / "other").write_text("nothing")
    for name in ("other", "missing"):
        with pytest.raises(DataError, match="coverdrive fit"):
            Learned.load(tmp_path / name)


def test_histograms_by_hand() -> None:
    samples = ScoredSamples(
        scores=np.array([[0.1, 0.9], [0.6, 0.7]]), base=np.array([0, 1]), distance=np.zeros(2), vehicle=np.arange(2)
    )
    driven, others = score_histograms(samples, np.array([0, 0.5, 1]))
    assert driven.tolist() == [[1, 0], [0, 1]]
    assert others.tolist() == [[0, 1], [0, 1]]
