"""The whole line from recordings to a certified predictor, and its file."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from prediction_fakes import SETTINGS

from coverdrive.certificates.bounds import rate_limit
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method, to_two_digits
from coverdrive.certificates.rule import Hyperplanes, Thresholds
from coverdrive.errors import CertificateError, DataError, SettingError
from coverdrive.planning.planner import MpcPlanner
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.fit import Fit, fit
from coverdrive.prediction.fits.calibrations import certify
from coverdrive.prediction.learning.affordance import affordance
from coverdrive.prediction.predictor import Predictor
from coverdrive.progress import heard_by
from coverdrive.recordings.recording import Recording
from coverdrive.road import LaneEdges, Road
from coverdrive.scene import Scene


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


def test_same_seed_same_predictor_however_the_lanes_of_a_straight_road_are_given(
    fitted: Fit, scenes: tuple[Recording, ...]
) -> None:
    road = scenes[0].road
    along = replace(road, changing=LaneEdges(np.array([0.0, road.length]), np.array([road.edges, road.edges])))
    again = fit([replace(scene, road=along) for scene in scenes], SETTINGS, seed=1).predictor
    assert np.array_equal(again.basis.points, fitted.predictor.basis.points)
    assert np.array_equal(again.rule.values, fitted.predictor.rule.values)
    assert again.fingerprint == fitted.predictor.fingerprint


def calibrated_again(
    predictor: Predictor, sides: ScoredSides, settings: CertificateSettings
) -> tuple[Predictor, tuple[Certificate, ...]]:
    """The same basis and network with the rule of these settings, and its certificates."""
    rule, certificates = calibrate(predictor.basis.radius, sides.train, sides.calibration, settings)
    return replace(predictor, rule=rule, calibrated=certificates[0]), certificates


def test_calibrating_on_training_samples_is_refused(fitted: Fit) -> None:
    predictor, training = fitted.predictor, fitted.scored.train
    with pytest.raises(CertificateError, match="also trained the network"):
        calibrate(predictor.basis.radius, training, training, SETTINGS.certificate)


def test_scores_of_the_same_split_give_the_same_rule(fitted: Fit) -> None:
    predictor, sides = fitted.predictor, fitted.scored
    again, _ = calibrated_again(predictor, sides, SETTINGS.certificate)
    assert np.array_equal(again.rule.values, predictor.rule.values)
    assert again.fingerprint == predictor.fingerprint == sides.predictor


def test_another_method_by_its_name(fitted: Fit) -> None:
    settings = CertificateSettings(method=Method.PAC_POOLED, epsilon=0.1, confidence=0.9, unit="window")
    predictor, sides = fitted.predictor, fitted.scored
    again, certificates = calibrated_again(predictor, sides, settings)
    assert len(np.unique(again.rule.values)) == 1
    assert [certificate.epsilon for certificate in certificates] == [0.1]
    assert evaluate(again.rule, sides.calibration).windows.value <= 0.1


@pytest.fixture(scope="module")
def hyperplanes(fitted: Fit) -> Predictor:
    """The same network with a hyperplane for every base."""
    predictor, sides = fitted.predictor, fitted.scored
    settings = CertificateSettings(method=Method.SVM, confidence=0.5, unit="window")
    again, certificates = calibrated_again(predictor, sides, settings)
    assert certificates[0].unit == "window"
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
    features = affordance(scene, road.edges)
    expected = hyperplanes.rule.possible(*hyperplanes.network.scores_and_hidden(features))
    assert np.array_equal(possible, expected)
    paths = loaded.predict(scene, road, ego=0, dt=0.5, steps=6)
    foreseen = possible[1:] | ~possible[1:].any(1, keepdims=True)  # where nothing is possible, anything may happen
    assert len(paths) == foreseen.sum()


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
    paths = predictor.predict(scene, road, ego=0, dt=0.25, steps=12)
    assert len(paths) == possible[1:].sum() > 0
    assert paths.points.shape == paths.half_sizes.shape == (len(paths), 13, 2)
    assert 0 not in paths.vehicle
    first = paths.points[:, 0]
    assert first[:, 0] == pytest.approx(scene.lon[paths.vehicle])
    assert first[:, 1] == pytest.approx(scene.lat[paths.vehicle])
    assert (np.diff(paths.points[..., 0], axis=1) >= 0).all()
    assert paths.weight is not None
    assert (paths.weight > 0).all() and 0 < paths.weight[paths.vehicle == 1].sum() <= 1 + 1e-6


def test_half_sizes_hold_body_and_tube(fitted: Fit) -> None:
    predictor = fitted.predictor
    paths = predictor.predict(three_vehicles(), Road.straight(), ego=0, dt=0.5, steps=6)
    base = np.nonzero(predictor.possible(three_vehicles(), Road.straight())[1:])[1]
    basis = predictor.basis
    assert basis.reach is not None
    half = np.minimum(basis.tolerance(1.0, np.array([3.0]))[0], basis.reach[-1] / basis.radius)
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
    assert len(fitted.predictor.predict(hidden, Road.straight(), ego=0, dt=0.25, steps=12)) == 0


def test_a_vehicle_without_a_possible_base_may_do_anything(fitted: Fit) -> None:
    nothing = Thresholds(np.full(len(fitted.predictor.basis), 2.0), fitted.predictor.rule.tube)
    strict = replace(fitted.predictor, rule=nothing)
    assert not strict.possible(three_vehicles(), Road.straight()).any()
    paths = strict.predict(three_vehicles(), Road.straight(), ego=0, dt=0.25, steps=12)
    np.testing.assert_array_equal(np.unique(paths.vehicle, return_counts=True)[1], len(strict.basis))


class Grid(NamedTuple):
    """What a planner looks like from here."""

    dt: float
    steps: int


def test_paths_like_those_of_a_planner_and_of_everybody(fitted: Fit) -> None:
    predictor, scene, road = fitted.predictor, three_vehicles(), Road.straight()
    asked, like = predictor.predict(scene, road, 0, 0.25, 12), predictor.predict(scene, road, 0, like=Grid(0.25, 12))
    assert np.array_equal(asked.points, like.points) and asked.dt == like.dt == 0.25
    everybody = predictor.predict(scene, road)
    assert set(everybody.vehicle) == {0, 1, 2}
    assert (everybody.dt, everybody.points.shape[1]) == (0.5, 7)


@pytest.mark.parametrize("ego", [-1, 3, 10, 2])
def test_who_asks_is_a_vehicle_of_the_scene(fitted: Fit, ego: int) -> None:
    scene = replace(three_vehicles(), valid=np.array([True, True, False]))
    with pytest.raises(SettingError, match=rf"ego = {ego} is not the slot .* 2 of them \(slots 0, 1\)"):
        fitted.predictor.predict(scene, Road.straight(), ego, 0.25, 12)


@pytest.mark.parametrize(
    ("dt", "steps", "said"),
    [
        (0.25, 13, "13 steps of 0.25 s are 3.25 s, .* within 3 s; take at most 12 steps"),
        (0.0, 12, "must be positive"),
        (-0.25, 12, "must be positive"),
        (float("nan"), 12, "must be positive"),
        (0.25, 0, "at least one, got 0"),
        (0.25, -3, "at least one, got -3"),
    ],
)
def test_paths_end_within_the_horizon(fitted: Fit, dt: float, steps: int, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        fitted.predictor.predict(three_vehicles(), Road.straight(), 0, dt, steps)


def test_times_are_those_of_a_planner_or_said_but_not_both(fitted: Fit) -> None:
    scene, planner = three_vehicles(), MpcPlanner()
    assert fitted.predictor.predict(scene, Road.straight(), 0, like=planner).points.shape[1] == planner.steps + 1
    with pytest.raises(SettingError, match="leave these out"):
        fitted.predictor.predict(scene, Road.straight(), 0, dt=0.1, like=planner)
    assert {fitted.predictor: 1}[fitted.predictor] == 1  # a key, told by what it is


def test_a_claim_is_given_by_name(scenes: tuple[Recording, ...]) -> None:
    result = fit(scenes, SETTINGS, seed=1, epsilon=0.2, confidence=0.8, unit="vehicle")
    certificate = result.predictor.certificate
    assert (certificate.epsilon, certificate.confidence, certificate.unit) == (0.2, 0.8, "vehicle")
    assert result.settings.certificate.epsilon == 0.2 and result.seed == 1
    for wrong in ({"epsilon": 1.0}, {"epsilon": 0.0}, {"confidence": 1.0}):
        with pytest.raises(SettingError, match=next(iter(wrong))):
            fit(scenes, SETTINGS, **wrong)


def test_what_cannot_be_proved_is_said_before_training(scenes: tuple[Recording, ...]) -> None:
    stages: list[str] = []
    with (
        heard_by(lambda stage, share: stages.append(stage)),
        pytest.raises(CertificateError, match=r"calibration vehicles.* cannot prove ε = 0.1 .*ask for it with"),
    ):
        fit(scenes, SETTINGS, seed=1, unit="vehicle", epsilon=0.1)
    assert "affordances and labels" in stages and "training" not in stages


@pytest.mark.slow
def test_of_independent_vehicles_what_can_be_proved_is_asked_for(scenes: tuple[Recording, ...]) -> None:
    result = fit(scenes, SETTINGS, seed=1, unit="vehicle")
    units = len(np.unique(result.scored.calibration.vehicle))
    assert result.predictor.certificate.epsilon == to_two_digits(rate_limit(0.9, 0, units)) > 0.1


def test_methods_side_by_side_need_nothing_but_the_scores(fitted: Fit) -> None:
    compared = certify(fitted, targets=(0.1, 0.2))
    assert {each.method for each in compared} == set(Method)
    assert all(each.certificate is None or each.certificate.confidence in (0.9, None) for each in compared)
    for wrong in ({"targets": [1.5]}, {"confidence": 1.0}):
        with pytest.raises(CertificateError, match="between 0 and 1"):
            certify(fitted, **wrong)
