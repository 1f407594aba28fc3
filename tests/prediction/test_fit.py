"""The whole line from recordings to a certified predictor, and its file."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Hyperplanes, Thresholds
from coverdrive.errors import CertificateError, DataError
from coverdrive.prediction.affordance import affordance
from coverdrive.prediction.basis import BasisSettings
from coverdrive.prediction.calibrate import CertificateSettings, calibrate
from coverdrive.prediction.fit import Fit, PredictionSettings, fit, score_sides
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.segments import SegmentSettings, cut_segments
from coverdrive.prediction.training import TrainingSettings
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.scene import Scene

SETTINGS = PredictionSettings(
    segments=SegmentSettings(stride=0.5),
    basis=BasisSettings(epsilon=1.0),
    training=TrainingSettings(epochs=5),
    certificate=CertificateSettings(confidence=0.9, unit="window"),
)


@pytest.fixture(scope="module")
def fitted(scenes: tuple[Recording, ...]) -> Fit:
    return fit(scenes, SETTINGS, seed=1)


def test_every_segment_is_accounted_for(fitted: Fit) -> None:
    sides = fitted.split
    assert (
        len(sides.train) + len(sides.calibration) + len(sides.test) + sides.dropped
        == len(fitted.segments)
        == 8 * 11 * 6
    )
    assert fitted.evaluation.windows.total == fitted.uncovered.total == len(sides.test)
    assert fitted.base_share.sum() == pytest.approx(1)


def test_certificates_in_both_units(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    windows = fitted.certificates[0]
    assert (windows.unit, windows.samples) == ("window", len(fitted.split.calibration))
    assert fitted.predictor.certificate == windows
    segments = cut_segments(scenes, SETTINGS.segments)
    vehicles = len(np.unique(segments.vehicle[fitted.split.calibration]))
    assert [c.samples for c in fitted.certificates[1:]] in ([vehicles], [])


def test_same_seed_same_predictor(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    again = fit(scenes, SETTINGS, seed=1).predictor
    assert np.array_equal(again.basis.points, fitted.predictor.basis.points)
    assert np.array_equal(again.rule.values, fitted.predictor.rule.values)


def test_calibrating_on_training_samples_is_refused(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    predictor = fitted.predictor
    training = score_sides(predictor, scenes, SETTINGS, seed=1).train
    with pytest.raises(CertificateError, match="also trained the network"):
        calibrate(predictor.basis, predictor.network, training, training, SETTINGS.certificate)


def test_scores_of_the_same_split_give_the_same_rule(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    predictor = fitted.predictor
    sides = score_sides(predictor, scenes, SETTINGS, seed=1)
    again, _ = calibrate(predictor.basis, predictor.network, sides.train, sides.calibration, SETTINGS.certificate)
    assert np.array_equal(again.rule.values, predictor.rule.values)
    other = score_sides(predictor, scenes, SETTINGS, seed=2)
    with pytest.raises(CertificateError, match="also trained the network"):
        calibrate(predictor.basis, predictor.network, sides.train, other.calibration, SETTINGS.certificate)


def test_another_method_by_its_name(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    settings = CertificateSettings(method=Method.PAC_POOLED, epsilon=0.1, confidence=0.9, unit="window")
    predictor = fitted.predictor
    sides = score_sides(predictor, scenes, SETTINGS, seed=1)
    again, certificates = calibrate(predictor.basis, predictor.network, sides.train, sides.calibration, settings)
    assert len(np.unique(again.rule.values)) == 1
    assert [certificate.epsilon for certificate in certificates] == [0.1]
    assert evaluate(again.rule, sides.calibration).windows.value <= 0.1


@pytest.fixture(scope="module")
def hyperplanes(fitted: Fit, scenes: tuple[Recording, ...]) -> Predictor:
    """The same network with a hyperplane for every base."""
    predictor = fitted.predictor
    sides = score_sides(predictor, scenes, SETTINGS, seed=1)
    settings = CertificateSettings(method=Method.SVM, confidence=0.5, unit="window", tube="per base")
    again, certificates = calibrate(predictor.basis, predictor.network, sides.train, sides.calibration, settings)
    assert certificates[0].unit == "window" and certificates[0].tubes == "per base"
    assert evaluate(again.rule, sides.calibration).windows.count == certificates[0].uncovered
    return again


def test_hyperplanes_are_stored_and_predict(hyperplanes: Predictor, fitted: Fit, tmp_path) -> None:
    assert isinstance(hyperplanes.rule, Hyperplanes)
    assert hyperplanes.fingerprint != fitted.predictor.fingerprint
    hyperplanes.save(tmp_path / "predictor.safetensors")
    loaded = Predictor.load(tmp_path / "predictor.safetensors")
    assert loaded.fingerprint == hyperplanes.fingerprint
    assert loaded.certificate == hyperplanes.certificate
    scene, road = three_vehicles(), Road.straight()
    possible = loaded.possible(scene, road)
    features = affordance(scene, road)
    expected = hyperplanes.rule.possible(np.zeros(possible.shape), np.asarray(hyperplanes.network.hidden(features)))
    assert np.array_equal(possible, expected)
    paths = loaded.predict(scene, road, own=0, dt=0.5, steps=6)
    foreseen = possible[1:] | ~possible[1:].any(1, keepdims=True)  # where nothing is possible, anything may happen
    assert len(paths) == foreseen.sum()


def test_conformal_methods_calibrate_no_tubes() -> None:
    with pytest.raises(ValidationError, match="pac-pooled calibrates no tubes"):
        CertificateSettings(method=Method.PAC_POOLED, epsilon=0.1, tube="per base")


@pytest.mark.parametrize("method", ["svm", "post-bloating"])
def test_methods_that_compute_their_bound_are_not_asked_for_one(method: str) -> None:
    assert CertificateSettings(method=Method(method)).asked is None
    assert CertificateSettings(method=Method.PAC_POOLED, epsilon=0.2).asked == 0.2


def test_file_round_trip(fitted: Fit, tmp_path) -> None:
    path = tmp_path / "deep" / "predictor.safetensors"
    fitted.predictor.save(path)
    loaded = Predictor.load(path)
    assert loaded.certificate == fitted.predictor.certificate
    features = np.random.default_rng(0).normal(10, 5, (50, 21)).astype(np.float32)
    assert np.array_equal(loaded.network.scores(features), fitted.predictor.network.scores(features))
    assert np.array_equal(loaded.rule.values, fitted.predictor.rule.values)
    assert np.array_equal(loaded.trained_on, fitted.predictor.trained_on)
    assert (
        loaded.basis.tolerance(1.0, np.ones(1)).tolist() == fitted.predictor.basis.tolerance(1.0, np.ones(1)).tolist()
    )
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_other_files_are_refused(tmp_path) -> None:
    with pytest.raises(DataError, match="not a predictor file"):
        Predictor.load(tmp_path / "missing.safetensors")
    (tmp_path / "text").write_text("hello, this is no tensor")
    with pytest.raises(DataError, match="not a predictor file"):
        Predictor.load(tmp_path / "text")


def three_vehicles() -> Scene:
    size = np.ones(3)
    return Scene(
        np.array([0.0, 30.0, 10.0]),
        np.array([1.8, 1.8, 5.4]),
        np.array([20.0, 15.0, 0.0]),
        np.zeros(3),
        4.8 * size,
        1.9 * size,
        np.array([True, True, True]),
    )


def test_predicted_paths(fitted: Fit) -> None:
    predictor, scene, road = fitted.predictor, three_vehicles(), Road.straight()
    possible = predictor.possible(scene, road)
    paths = predictor.predict(scene, road, own=0, dt=0.25, steps=12)
    assert len(paths) == possible[1:].sum() > 0
    assert paths.points.shape == paths.half_sizes.shape == (len(paths), 13, 2)
    assert 0 not in paths.vehicle
    first = paths.points[:, 0]
    assert first[:, 0] == pytest.approx(scene.lon[paths.vehicle])
    assert first[:, 1] == pytest.approx(scene.lat[paths.vehicle])
    assert (np.diff(paths.points[..., 0], axis=1) >= 0).all()


def test_half_sizes_hold_body_and_tube(fitted: Fit) -> None:
    predictor = fitted.predictor
    paths = predictor.predict(three_vehicles(), Road.straight(), own=0, dt=0.5, steps=6)
    base = np.nonzero(predictor.possible(three_vehicles(), Road.straight())[1:])[1]
    basis = predictor.basis
    assert basis.reach is not None
    half = np.minimum(basis.tolerance(1.0, np.array([3.0]))[0], basis.reach[-1] / basis.epsilon)
    tube = half * predictor.rule.tube[base, None]
    assert paths.ellipses is not None
    ellipses = basis.tolerance(1.0, 0.5 * np.arange(7)) * predictor.rule.tube[base, None, None]
    np.testing.assert_allclose(paths.ellipses, ellipses)
    assert (paths.half_sizes[:, 6] >= np.array([2.4, 0.95]) * np.cos(0.3) + tube - 1e-9).all()
    heading_free = np.abs(basis.points[base][:, -1, 1]) < 1e-9
    assert paths.half_sizes[heading_free, 6] == pytest.approx(np.array([2.4, 0.95]) + tube[heading_free], abs=1e-6)


def test_empty_slots_have_no_paths(fitted: Fit) -> None:
    scene = three_vehicles()
    hidden = Scene(
        scene.lon, scene.lat, scene.speed, scene.heading, scene.length, scene.width, np.array([True, False, False])
    )
    assert len(fitted.predictor.predict(hidden, Road.straight(), own=0, dt=0.25, steps=12)) == 0


def test_a_vehicle_without_a_possible_base_may_do_anything(fitted: Fit) -> None:
    nothing = Thresholds(np.full(len(fitted.predictor.basis), 2.0), fitted.predictor.rule.tube)
    strict = replace(fitted.predictor, rule=nothing)
    assert not strict.possible(three_vehicles(), Road.straight()).any()
    paths = strict.predict(three_vehicles(), Road.straight(), own=0, dt=0.25, steps=12)
    np.testing.assert_array_equal(np.unique(paths.vehicle, return_counts=True)[1], len(strict.basis))
