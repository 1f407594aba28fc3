"""Networks that see the lateral motion."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from prediction_fakes import described

from coverdrive.prediction.fit import Fit, PredictionSettings
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.road import Road
from coverdrive.scene import Scene


def test_a_predictor_that_sees_the_motion_is_stored_whole_and_uses_the_heading(fitted: Fit, tmp_path: Path) -> None:
    features = np.random.default_rng(0).normal(10, 5, (50, 22)).astype(np.float32)
    bases = len(fitted.predictor.basis)
    network = Network.create(features, (8,), bases, np.random.default_rng(0), inputs="motion", output="softmax")
    predictor = replace(fitted.predictor, network=network)
    predictor.save(tmp_path / "predictor.safetensors")
    loaded = Predictor.load(tmp_path / "predictor.safetensors")
    assert loaded.network.inputs == "motion" and loaded.network.mean.shape == (40,)
    assert np.array_equal(loaded.network.scores(features), network.scores(features))
    one = np.ones(2)
    scene = Scene(np.array([0.0, 30.0]), 5.4 * one, 20 * one, 0.02 * one, 4.8 * one, 1.9 * one, one > 0)
    assert loaded.possible(scene, Road.straight()).shape == (2, len(loaded.basis))
    seen = np.asarray(loaded.network.scaled(described(scene, Road.straight().edges)))[:, -1]
    assert seen * loaded.network.scale[-1] + loaded.network.mean[-1] == pytest.approx(20 * np.sin(0.02) * one, abs=1e-5)


def test_the_paper_sees_no_motion() -> None:
    assert PredictionSettings.paper().training.inputs == "affordance"
    assert PredictionSettings().training.inputs == "derived"
