"""Boxes whose place and size are learned: scores, training, and the predictor."""

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.tree_util import Partial
from prediction_fakes import segments_of

from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Thresholds, scale_of
from coverdrive.errors import SettingError
from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.boxes.boxes import TUBE, WHOLE, Boxes, constant_velocity, scored_by
from coverdrive.prediction.boxes.network import BoxNetwork
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.boxes.training import BoxSettings, box_loss, train_boxes
from coverdrive.prediction.certifying.occupied import union_area
from coverdrive.prediction.data.segments import WATCHED, Segments, watched
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.fits.calibrations import certify
from coverdrive.prediction.learning.affordance import mirrored_features
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.recording import Recording
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from coverdrive.scene import Scene


@pytest.fixture(scope="module", params=["share", "vehicle"])
def fitted(boxed: Callable[[str], Fit], request: pytest.FixtureRequest) -> Fit:
    """Of claims about shares of windows, and of those about vehicles, whose boxes are crosses."""
    return boxed(request.param)


@pytest.fixture(scope="module")
def seen() -> np.ndarray:
    """Features of fifty segments."""
    return np.random.default_rng(0).normal(size=(50, 22)).astype(np.float32)


LITTLE = BoxSettings(most_steps=5, batch=8, hidden=(4,), members=2)
"""settings of several tests, for which training is compiled once"""


@pytest.fixture
def untrained(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Where training leaves the network as it is; the powers of the norms that it was to minimise."""
    powers = list[float]()

    def optimised(network: Network, _features: object, _targets: object, loss: Partial, *_: object):
        powers.append(loss.keywords["power"])
        return eqx.tree_at(lambda made: made.weights[-1], network, 10 * network.weights[-1]), np.zeros(1)

    monkeypatch.setattr("coverdrive.prediction.boxes.training.optimised", optimised)
    return powers


def straight(count: int, seed: int = 0) -> Segments:
    """Segments that brake or speed up, by a number that is their first feature, and stay in their lane."""
    random = np.random.default_rng(seed)
    times, acceleration = 0.5 * np.arange(7), random.uniform(-3, 3, count)
    points = np.stack([acceleration[:, None] * times**2 / 2, np.zeros((count, 7))], -1)
    noise = 0.05 * random.normal(size=points.shape) * (times > 0)[:, None]
    return segments_of(points + noise)


def test_a_score_is_the_least_scale_that_holds_the_whole_body() -> None:
    segments = segments_of(np.zeros((2, 7, 2)))
    segments.points[0, 3] = [1.0, -0.6]
    segments.heading[1, 2] = 0.1
    boxes = Boxes(np.zeros((2, 6, 2)), np.full((2, 6, 2), 0.5))
    half_length, half_width = segments.half_sizes[0]
    turned = half_length * np.sin(0.1) + half_width * np.cos(0.1) - half_width
    scored = scored_by(boxes, segments)
    np.testing.assert_allclose(scored.scores[:, 0], [1 / (1 + 1.0 / 0.5), 1 / (1 + turned / 0.5)])
    assert scored.area is not None and scored.area.tolist() == [1.0, 1.0]
    assert (scored.distance <= TUBE).all()
    assert scale_of(Thresholds(scored.scores[0], np.ones(1))) == pytest.approx(2.0)


def test_one_arm_of_a_cross_has_to_hold_a_body_at_all_times() -> None:
    segments = segments_of(np.zeros((4, 7, 2)))
    segments.points[0, 4] = [1.0, 0.0]  # far ahead: in the long arm
    segments.points[1, 4] = [0.0, 1.0]  # far aside: in the wide arm
    segments.points[2, 4] = [1.0, 1.0]  # both at once
    segments.points[3, 2], segments.points[3, 4] = [1.0, 0.0], [0.0, 1.0]  # one after the other
    boxes = Boxes(np.zeros((4, 6, 2)), np.ones((4, 6, 2)), np.array([[1.0, 0.5], [0.8, 1.0]]))
    scored = scored_by(boxes, segments)
    np.testing.assert_allclose(1 / scored.scores[:, 0] - 1, [1.0, 1.0, 1.25, 1.25])
    union = union_area(np.zeros((2, 2)), boxes.arms)
    np.testing.assert_allclose(boxes.areas, union)
    assert union == pytest.approx(4 * (0.5 + 0.8 - 0.4))


def test_what_no_box_holds_is_outside_of_every_set() -> None:
    segments = segments_of(np.full((1, 7, 2), 2000.0))
    boxes = Boxes(np.zeros((1, 6, 2)), np.ones((1, 6, 2)))
    assert scored_by(boxes, segments).distance[0] > TUBE
    assert scale_of(Thresholds(np.zeros(1), np.ones(1))) == pytest.approx(999)


def test_training_finds_where_vehicles_go_and_how_sure_that_is() -> None:
    segments, others = straight(600), straight(200, seed=1)

    def features_of(chosen: Segments) -> np.ndarray:
        features = np.random.default_rng(2).normal(size=(len(chosen), 22)).astype(np.float32)
        features[:, 0] = chosen.points[:, -1, 0]
        return features

    plain = {"noise": 0.0, "dropout": 0.0, "weight_decay": 0.0, "few": 0}
    settings = BoxSettings(most_steps=600, batch=128, hidden=(32,), members=2, inputs="affordance", **plain)
    network, losses = train_boxes(features_of(segments), segments, settings)
    assert losses[-1] < losses[0]
    boxes, trivial = network.boxes_of(features_of(others)), constant_velocity(segments)

    def area(each: Boxes) -> float:
        """[m²] of the sets that hold nine tenths of the other segments."""
        worst = 1 / np.quantile(scored_by(each, others).scores, 0.1) - 1
        return float(each.areas.mean()) * worst**2

    assert area(boxes) < 0.3 * area(trivial)
    assert np.array_equal(train_boxes(features_of(segments), segments, settings)[1], losses)


def test_boxes_are_the_same_part_by_part(seen: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    segments = straight(50)
    network, losses = train_boxes(seen, segments, LITTLE)
    whole = network.boxes_of(seen)
    scores = scored_by(whole, segments).scores
    monkeypatch.setattr("coverdrive.prediction.data.parts.PART", 20)
    parts = network.boxes_of(seen)
    np.testing.assert_allclose(parts.centre, whole.centre, atol=1e-6)
    np.testing.assert_allclose(parts.half_sizes, whole.half_sizes, rtol=1e-6)
    assert parts.centre.dtype == whole.half_sizes.dtype == np.float64
    np.testing.assert_array_equal(scored_by(whole, segments).scores, scores)
    np.testing.assert_array_equal(train_boxes(seen, segments, LITTLE)[1], losses)


def test_mirror_images_are_trained_on_as_if_they_had_been_recorded(seen: np.ndarray) -> None:
    segments = straight(50)
    segments.points[:, 1:, 1] += np.linspace(0.5, 3, 6)
    segments.heading[:, 1:] = 0.1
    both = {name: np.tile(values, 2) for name, values in vars(segments).items() if np.ndim(values) == 1}
    both |= {
        name: np.concatenate([getattr(each, name) for each in (segments, segments.mirrored)])
        for name in ("points", "heading", "half_sizes")
    }
    every, alone = np.concatenate([seen, mirrored_features(seen)]), LITTLE.model_copy(update={"mirrored": False})
    losses = train_boxes(seen, segments, LITTLE)[1]
    np.testing.assert_array_equal(train_boxes(every, replace(segments, **both), alone)[1], losses)


def test_of_few_vehicles_only_the_urgency_is_seen(seen: np.ndarray, untrained: list[float]) -> None:
    for few, inputs in ((50, "motion"), (51, "urgency")):
        network, _ = train_boxes(seen, straight(50), LITTLE.model_copy(update={"few": few}))
        assert network.network.inputs == inputs


def test_sizes_that_few_vehicles_taught_differ_less(seen: np.ndarray, untrained: list[float]) -> None:
    def of_few(few: int, unit: Unit = "vehicle") -> BoxNetwork:
        settings = LITTLE.model_copy(update={"few": few, "inputs": "urgency", "mirrored": False})
        return train_boxes(seen, straight(50), settings, unit=unit)[0]

    network, evened = of_few(0), of_few(51)
    (centre, size), (evened_centre, evened_size) = (
        np.split(np.asarray(each.network.outputs(each.network.scaled(seen))), 2, axis=-1) for each in (network, evened)
    )
    np.testing.assert_allclose(evened_centre, centre, atol=1e-5)
    assert size.std(1).mean() > 0.1
    np.testing.assert_allclose(evened_size, 0.7 * size + 0.3 * size.mean(1, keepdims=True), atol=1e-5)
    np.testing.assert_array_equal(*(of_few(few, "share").arrays["weight_1"] for few in (0, 51)))
    assert {array.dtype for array in evened.arrays.values()} == {array.dtype for array in network.arrays.values()}


def test_claims_about_windows_leave_more_of_them_outside(seen: np.ndarray, untrained: list[float]) -> None:
    for unit in get_args(Unit):
        train_boxes(seen, straight(50), LITTLE, unit=unit)
    assert dict(zip(get_args(Unit), untrained, strict=True)) == {
        "window": 3.0, "share": 3.0, "vehicle": 12.0, "group": 12.0,
    }  # fmt: skip


def test_the_loss_by_hand() -> None:
    random = np.random.default_rng(0)
    usual, wanted = random.uniform(0.5, 2, (6, 2)), random.uniform(0, 2, (5, 6, 4)).astype(np.float32)
    given = jnp.zeros((5, BoxNetwork.outputs(6))), jnp.asarray(wanted), jnp.asarray(usual)
    loss = jax.jit(box_loss, static_argnums=3)(*given, 3.0)
    beyond = ((wanted[..., :2] + wanted[..., 2:]) / usual).reshape(5, -1)
    scale = (beyond**12).sum(1) ** (1 / 12)
    assert float(loss) == pytest.approx(
        np.log(usual.prod(1).mean()) + 2 * np.log((scale**3).mean() ** (1 / 3)), rel=1e-4
    )


@pytest.mark.slow
def test_a_smaller_power_leaves_more_outside() -> None:
    segments = straight(300)
    segments.points[::10, 1:, 1] += np.linspace(0.5, 3, 6)
    features = np.zeros((300, 22), dtype=np.float32)
    settings = BoxSettings(most_steps=200, batch=128, hidden=(8,), members=1, noise=0.0, dropout=0.0)
    areas = {}
    for unit in ("vehicle", "share"):
        boxes = replace(train_boxes(features, segments, settings, unit=unit)[0].boxes_of(features), arms=WHOLE)
        scale = 1 / np.quantile(scored_by(boxes, segments).scores, [0.5, 0.002]) - 1
        areas[unit] = boxes.areas.mean() * scale**2
    assert areas["share"][0] < areas["vehicle"][0] and areas["share"][1] > areas["vehicle"][1]


def test_a_window_is_covered_exactly_if_its_body_is_in_the_predicted_boxes(
    fitted: Fit, scenes: tuple[Recording, ...]
) -> None:
    predictor, segments, test = fitted.predictor.scaled(1.0), fitted.segments, fitted.split.test
    assert isinstance(predictor, BoxPredictor)
    covered = predictor.rule.possible(fitted.scored.test.scores)[:, 0]
    assert fitted.evaluation.not_predicted == (~covered).sum() < len(test)
    margins = []
    for row, expected in zip(test[::7], covered[::7], strict=True):
        recording = scenes[segments.recording[row]]
        start = recording.table.row(int(segments.row[row]), named=True)
        scene = recording.scene_at(start["time"])
        slot = int(np.flatnonzero(np.isclose(scene.lon, start["seen_lon"]))[0])
        paths = predictor.predict(scene, recording.road, None, WATCHED, 30)
        mine = paths.vehicle == slot
        assert set(paths.vehicle) == set(range(scene.vehicles)) and mine.sum() >= len(predictor.network.arms)
        seen = watched(scenes, segments.of(np.array([row])))
        actual = seen.points[0] + [scene.lon[slot], scene.lat[slot]]
        actual[:, 0] += seen.speed[0] * seen.step * np.arange(31)
        body = turned_half_extents(seen.half_sizes[0], seen.heading[0])
        learned = np.flatnonzero(mine)[: len(predictor.network.arms)]
        margin = (paths.half_sizes[learned] - np.abs(actual - paths.points[learned]) - body)[:, 1:].min((1, 2)).max()
        assert (margin > 0) == expected or abs(margin) < 1e-3
        margins.append(margin)
    assert min(margins) < 0 < max(margins) or covered[::7].all()


def test_boxes_follow_the_vehicle_whatever_its_slot_and_begin_with_its_body(fitted: Fit) -> None:
    scene, road = three_vehicles(), Road.straight()
    paths = fitted.predictor.predict(scene, road, ego=0, dt=0.25, steps=12)
    arms = arms_of(fitted)
    assert paths.vehicle.tolist() == [1, 2] * arms and paths.points.shape == (2 * arms, 13, 2) and paths.dt == 0.25
    np.testing.assert_allclose(paths.points[:, 0], scene.states[paths.vehicle, :2], atol=1e-9)
    beyond = paths.half_sizes - scene.half_sizes[paths.vehicle][:, None]
    unknown = beyond[:, 0] / beyond[:, 2]
    np.testing.assert_allclose(unknown, np.tile(fitted.predictor.network.early, (2 * arms, 1)), rtol=1e-6)
    assert (unknown > 0).all() and (unknown < 0.7).all()
    order = np.array([2, 0, 1])
    turned = Scene(**{name: values[order] for name, values in vars(scene).items()})
    again = fitted.predictor.predict(turned, road, ego=1, dt=0.25, steps=12)
    there = np.arange(2 * arms) ^ 1  # the slots are exchanged in every arm
    np.testing.assert_allclose(again.points[there], paths.points, atol=1e-3)
    np.testing.assert_allclose(again.half_sizes[there], paths.half_sizes, atol=1e-3)


def test_a_bend_changes_nothing_in_the_frame_of_the_road(fitted: Fit) -> None:
    line = ReferenceLine(np.zeros(2), 0.0, np.full(1001, 1 / 1000), 1000.0)
    bent = fitted.predictor.predict(three_vehicles(), replace(Road.straight(), line=line))
    straight = fitted.predictor.predict(three_vehicles(), Road.straight())
    np.testing.assert_array_equal(bent.points, straight.points)
    np.testing.assert_array_equal(bent.half_sizes, straight.half_sizes)


def test_asking_beyond_the_horizon_or_for_nobody_is_refused(fitted: Fit) -> None:
    scene, road = three_vehicles(), Road.straight()
    assert fitted.predictor.horizon == 3.0
    with pytest.raises(SettingError, match="within 3 s"):
        fitted.predictor.predict(scene, road, dt=0.5, steps=7)
    with pytest.raises(SettingError, match="not the slot"):
        fitted.predictor.predict(scene, road, ego=3)


def test_traffic_drives_within_the_boxes(fitted: Fit) -> None:
    scene, road, times = three_vehicles(), Road.straight(), 0.5 * np.arange(7)
    predictor = fitted.predictor.scaled(1.0)
    deviation, rate, possible = predictor.choices(scene, road, times)
    paths = predictor.predict(scene, road, None, 0.5, 6)
    moved = scene.states[:, None, None, :2] + deviation
    moved[..., 0] += scene.states[:, None, None, 2] * times
    centre, half_sizes = (each.reshape(arms_of(fitted), 3, 1, 7, 2) for each in (paths.points, paths.half_sizes))
    apart = np.abs(moved - centre) + scene.half_sizes[:, None, None]
    assert (apart <= half_sizes + 1e-9).all((3, 4)).any(0).all()
    assert deviation.shape == rate.shape == (3, 9, 7, 2) and possible.all()
    nobody = replace(scene, valid=np.zeros(3, dtype=bool))
    assert not fitted.predictor.choices(nobody, road, times)[2].any()


def test_file_round_trip(fitted: Fit, tmp_path) -> None:
    file = tmp_path / "predictor.safetensors"
    fitted.predictor.save(file)
    loaded = Predictor.load(file)
    assert isinstance(loaded, BoxPredictor)
    assert loaded.fingerprint == fitted.predictor.fingerprint and loaded.certificate == fitted.predictor.certificate
    scene, road = three_vehicles(), Road.straight()
    ours, theirs = (each.predict(scene, road) for each in (fitted.predictor, loaded))
    assert np.array_equal(ours.points, theirs.points) and np.array_equal(ours.half_sizes, theirs.half_sizes)


def test_all_methods_calibrate_the_scale(fitted: Fit) -> None:
    compared = certify(fitted, [0.2], "window", 0.9)
    made = {each.method for each in compared if each.certificate}
    assert {Method.PAC_POOLED, Method.NESTED_SETS, Method.DISCARDING} <= made
    assert Method.SVM not in made
    for each in compared:
        if each.evaluation is not None:
            assert each.evaluation.mean_area is not None and each.evaluation.mean_area > 0
    asked = next(each for each in compared if each.method is Method.PAC_POOLED)
    assert asked.evaluation is not None and asked.evaluation.windows.low <= 0.2


def test_areas_of_the_fit_are_those_of_its_predictions(fitted: Fit) -> None:
    occupied, evaluation = fitted.occupied, fitted.evaluation
    assert occupied.seconds == (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
    assert evaluation.mean_area == pytest.approx(occupied.mean)
    assert occupied.baseline_evaluation is not None
    assert occupied.ratio == pytest.approx(occupied.mean / np.mean(occupied.baseline))
    assert evaluation.size == evaluation.mean_area and "m²" in evaluation.sized


def test_area_of_a_union() -> None:
    centre, half_sizes = np.array([[0.0, 0.0], [1.0, 0.0], [9.0, 9.0]]), np.array([[1.0, 1.0], [1.0, 0.5], [0.5, 2.0]])
    assert union_area(centre, half_sizes) == pytest.approx(4 + 1 + 4)
    assert union_area(centre[:1], half_sizes[:1]) == pytest.approx(4)


def test_an_unforeseen_lane_change_and_the_hardest_braking_have_an_arm_each(fitted: Fit) -> None:
    scene, arms = three_vehicles(), arms_of(fitted)
    paths = fitted.predictor.predict(scene, Road.straight(), None, 0.5, 6)
    size = paths.half_sizes.reshape(arms, 3, 7, 2)[:, :, 1:] - scene.half_sizes[:, None]
    assert arms == (2 if fitted.settings.certificate.unit == "vehicle" else 1)
    np.testing.assert_allclose(size[0, ..., 0], size[..., 0].max(0))
    np.testing.assert_allclose(size[-1, ..., 1], size[..., 1].max(0))
    np.testing.assert_allclose(size[0, ..., 1] / size[-1, ..., 1], 0.6 if arms == 2 else 1)
    np.testing.assert_allclose(size[-1, ..., 0] / size[0, ..., 0], 0.7 if arms == 2 else 1)


def arms_of(fitted: Fit) -> int:
    """Boxes that a vehicle has."""
    assert isinstance(fitted.predictor, BoxPredictor)
    return len(fitted.predictor.network.arms)


def three_vehicles() -> Scene:
    return Scene(
        lon=np.array([0.0, 30.0, 10.0]), lat=np.array([1.8, 1.8, 5.4]), speed=np.array([20.0, 15.0, 12.0]),
        heading=np.zeros(3), length=np.full(3, 4.8), width=np.full(3, 1.9), valid=np.ones(3, dtype=bool),
    )  # fmt: skip
