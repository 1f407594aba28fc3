"""Sets of any scale: nested, the calibrated ones at 1, the likeliest path alone at 0, and what is proved of each."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from prediction_fakes import SETTINGS

from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.errors import SettingError
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.certifying.calibrate import proved_scales
from coverdrive.prediction.fit import USUALLY_LEFT, Fit, PredictionSettings, fit, scale_left
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.scene import Scene

SCALES = (0.0, 0.2, 0.5, 0.9, 1.0, 1.3, 3.0)
ROAD = Road.straight()


@pytest.fixture(scope="module")
def boxed(boxed: Callable[[str], Fit]) -> Fit:
    return boxed("share")


def crossing() -> Scene:
    """Three vehicles, one of which is on its way to the next lane at 1 m/s."""
    return Scene(
        lon=np.array([0.0, 30.0, 60.0]),
        lat=np.array([1.8, 5.4, 3.6]),
        speed=np.array([20.0, 22.0, 25.0]),
        heading=np.array([0.0, 0.0, 0.04]),
        length=np.full(3, 4.8),
        width=np.full(3, 1.9),
        valid=np.ones(3, dtype=bool),
    )


def held(inner, outer) -> bool:
    """Whether each of the inner paths' boxes is within one of the outer ones of its vehicle, at all times."""
    for path in range(len(inner)):
        mine = outer.vehicle == inner.vehicle[path]
        beyond = np.abs(inner.points[path] - outer.points[mine]) + inner.half_sizes[path] - outer.half_sizes[mine]
        if not (beyond <= 1e-9).all((1, 2)).any():
            return False
    return True


@pytest.mark.parametrize("kind", ["boxes", "bases"])
def test_sets_are_nested_in_their_scale(kind: str, boxed: Fit, fitted: Fit) -> None:
    predictor = (boxed if kind == "boxes" else fitted).predictor
    paths = [predictor.scaled(scale).predict(crossing(), ROAD) for scale in SCALES]
    for smaller, larger in pairwise(paths):
        assert held(smaller, larger)
    assert not held(paths[4], paths[1])  # they grow
    body = crossing().half_sizes
    assert len(paths[0]) == 3  # the likeliest path alone
    if kind == "boxes":
        np.testing.assert_allclose(paths[0].half_sizes, np.broadcast_to(body[:, None], paths[0].half_sizes.shape))


def test_where_nothing_is_predicted_a_smaller_set_is_the_likeliest_alone(fitted: Fit) -> None:
    assert isinstance(fitted.predictor, Predictor)
    none = replace(fitted.predictor, rule=replace(fitted.predictor.rule, values=np.ones(len(fitted.predictor.basis))))
    everything = none.predict(crossing(), ROAD)
    assert len(everything) == 3 * len(none.basis)
    assert len(none.scaled(0.5).predict(crossing(), ROAD)) == 3
    assert len(none.scaled(2.0).predict(crossing(), ROAD)) == len(everything)


def test_traffic_drives_within_the_calibrated_sets_however_bold_the_ego_is(boxed: Fit) -> None:
    times = 0.1 * np.arange(31)
    usual, bold = (boxed.predictor.scaled(scale).choices(crossing(), ROAD, times) for scale in (1.0, 0.1))
    for one, other in zip(usual, bold, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_certificate_of_a_smaller_set_is_what_is_proved_of_it(boxed: Fit) -> None:
    predictor, claim = boxed.predictor, boxed.certificates[0]
    assert predictor.scaled(1.0).certificate == claim
    assert predictor.scaled(2.0).certificate.epsilon == claim.epsilon
    bounds, least = predictor.rungs.T
    assert (np.diff(bounds) > 0).all() and (np.diff(least) <= 0).all() and (bounds > claim.epsilon).all()
    for bound, scale in predictor.rungs.tolist():
        assert predictor.scaled(min(scale + 1e-9, 1.0)).certificate.epsilon <= bound
    nothing = predictor.scaled(0.0).certificate
    assert nothing.epsilon == 1 and nothing.sentence.startswith("Nothing is proved")
    assert "boxes of 0.9 times the calibrated size" in predictor.scaled(0.9).certificate.sentence


def test_rungs_hold_all_at_once_and_are_what_each_would_be_with_its_share(boxed: Fit) -> None:
    """Those of the claim itself, proved with all of the error probability, need no larger sets than with a share."""
    predictor, claim = boxed.predictor, boxed.certificates[0]
    found = proved_scales(predictor.rule, predictor.trained_on, boxed.scored.calibration, claim)
    np.testing.assert_array_equal(found, predictor.rungs)
    weaker = replace(claim, confidence=0.5)
    easier = dict(proved_scales(predictor.rule, predictor.trained_on, boxed.scored.calibration, weaker).tolist())
    assert all(easier[bound] <= scale + 1e-12 for bound, scale in found.tolist())
    unsure = replace(claim, confidence=None)
    assert len(proved_scales(predictor.rule, predictor.trained_on, boxed.scored.calibration, unsure)) == 0


def test_a_fit_begins_with_the_scale_that_a_usual_share_of_calibration_windows_leaves(boxed: Fit) -> None:
    calibration, predictor = boxed.scored.calibration, boxed.predictor
    _, vehicle = np.unique(calibration.vehicle, return_inverse=True)

    def left(scale: float) -> float:
        missed = 1 / calibration.score_of_base - 1 > scale * (1 / predictor.rule.arrays["thresholds"][0] - 1)
        return float((np.bincount(vehicle, missed) / np.bincount(vehicle)).mean())

    assert left(predictor.scale * 1.001) <= USUALLY_LEFT <= left(predictor.scale * 0.999)
    assert scale_left(predictor, calibration, 0.1) > predictor.scale
    assert replace(boxed.driven, kinds={}) == evaluate(predictor.rule, boxed.scored.test, predictor.scale)
    assert boxed.driven.shares.value >= boxed.evaluation.shares.value
    assert boxed.driven.mean_area == pytest.approx(predictor.scale**2 * boxed.evaluation.mean_area)


def test_bases_begin_as_they_were_calibrated(fitted: Fit) -> None:
    assert fitted.predictor.scale == 1.0 and PredictionSettings.paper().scale == 1.0
    smaller = evaluate(fitted.predictor.rule, fitted.scored.test, 0.5)
    assert smaller.windows.value >= fitted.evaluation.windows.value


@pytest.mark.parametrize("kind", ["boxes", "bases"])
def test_a_scale_is_stored(kind: str, boxed: Fit, fitted: Fit, tmp_path) -> None:
    predictor = (boxed if kind == "boxes" else fitted).predictor.scaled(0.7)
    predictor.save(str(tmp_path / "one.safetensors"))
    loaded = Predictor.load(str(tmp_path / "one.safetensors"))
    assert loaded.scale == 0.7 and loaded.certificate == predictor.certificate
    assert loaded.fingerprint == predictor.fingerprint != predictor.scaled(1).fingerprint
    np.testing.assert_array_equal(loaded.rungs, predictor.rungs)


@pytest.mark.parametrize("scale", [-0.1, 101.0, np.nan, np.inf])
def test_a_scale_that_makes_no_sense_is_refused(scale: float, boxed: Fit) -> None:
    with pytest.raises(SettingError, match="between 0"):
        boxed.predictor.scaled(scale)


def test_hyperplanes_have_no_scale(scenes: tuple[Recording, ...]) -> None:
    pytest.importorskip("piqp")
    claim = SETTINGS.certificate.model_copy(update={"method": Method.SVM})
    predictor = fit(scenes, SETTINGS.model_copy(update={"certificate": claim}), seed=1).predictor
    with pytest.raises(SettingError, match="have no scale"):
        predictor.scaled(0.5).predict(crossing(), ROAD)


def test_every_scale_of_boxes_is_certified_on_vehicles_that_neither_trained_nor_calibrated(boxed: Fit) -> None:
    assert isinstance(boxed.predictor, BoxPredictor)
    trained, calibrated = boxed.predictor.trained_on, np.unique(boxed.scored.calibration.vehicle)
    assert not set(trained) & set(calibrated)
