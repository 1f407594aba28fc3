"""Bodies in boxes: by hand, corner by corner, and in the boxes that planning gets."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from prediction_fakes import segments_of

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Thresholds
from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.motion import follow
from coverdrive.prediction.data.segments import Segments, SegmentSettings, cut_segments
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.samples import body_radius, make_samples
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.scene import Scene

TIME = 0.5 * np.arange(7)


def manoeuvres() -> Basis:
    """Keep on; brake at 2 m/s²; move 3.6 m to the left; with a tube that is cut at the start."""
    points = np.zeros((3, 7, 2))
    points[1, :, 0] = -(TIME**2)
    points[2, :, 1] = 3.6 * (1 - np.cos(np.pi * TIME / 3)) / 2
    basis = Basis(points, radius=0.5, aspect=4.0, growth=1.0, step=0.5)
    return replace(basis, reach=basis.tolerance(0.5, TIME) * np.minimum(1.0, 0.4 + 0.2 * TIME)[:, None])


def test_a_body_that_is_turned_as_the_base_needs_what_its_centre_needs() -> None:
    basis = manoeuvres()
    offset = np.zeros((7, 2))
    offset[4] = [0.0, 0.3]
    segments = segments_of(basis.points[:1] + offset)
    assert body_radius(basis, segments)[0, 0] == pytest.approx(0.3 / basis.tube(TIME)[4, 1])


def test_a_turned_body_sticks_out_of_a_tube_that_holds_its_centre() -> None:
    basis = manoeuvres()
    segments = segments_of(basis.points[:1])
    turned = replace(segments, heading=np.where(np.arange(7) == 6, 0.2, 0.0)[None])
    beyond = 2.4 * np.sin(0.2) + 0.95 * np.cos(0.2) - 0.95
    assert basis.distance(turned.points)[0, 0] == 0.0
    assert body_radius(basis, turned)[0, 0] == pytest.approx(beyond / basis.tube(TIME)[6, 1])
    # who follows the curved base is turned as it is, and sticks out if it is not
    times, (deviation, rate) = basis.times, basis.rollout(basis.times)
    heading = follow(np.array([0.0, 0.0, 20.0, 0.0]), times, deviation[2], rate[2])[:, 3]
    on_it = replace(segments_of(basis.points[2:]), heading=heading[None])
    assert body_radius(basis, on_it)[0, 2] == pytest.approx(0.0, abs=1e-12)
    assert body_radius(basis, replace(on_it, heading=-2 * on_it.heading))[0, 2] > 0.1


def random_segments(count: int, seed: int) -> Segments:
    random = np.random.default_rng(seed)
    basis = manoeuvres()
    points = basis.points[random.integers(3, size=count)] + 0.2 * random.normal(size=(count, 7, 2)) * [2.0, 0.5]
    points[:, 0] = 0.0
    return replace(
        segments_of(points),
        speed=random.uniform(0.0, 30.0, count),
        heading=random.normal(0.0, 0.06, (count, 7)),
        half_sizes=random.uniform([1.8, 0.8], [6.0, 1.3], (count, 2)),
    )


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000))
def test_corners_stay_in_the_boxes_of_that_radius_and_of_none_smaller(seed: int) -> None:
    basis, segments = manoeuvres(), random_segments(4, seed)
    distance = body_radius(basis, segments)
    deviation, rate = basis.rollout(TIME)
    corners = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    for n in range(4):
        for base in range(3):
            motion = follow(np.array([0.0, 0.0, segments.speed[n], 0.0]), TIME, deviation[base], rate[base])
            body = turned_half_extents(segments.half_sizes[n, None], motion[:, 3])
            outmost = np.zeros((7, 2))
            for side in corners * segments.half_sizes[n]:
                cosine, sine = np.cos(segments.heading[n]), np.sin(segments.heading[n])
                corner = np.stack([cosine * side[0] - sine * side[1], sine * side[0] + cosine * side[1]], axis=-1)
                outmost = np.maximum(outmost, np.abs(segments.points[n] + corner - basis.points[base]))
            held = [
                bool((outmost <= body + factor * distance[n, base] * basis.tube(TIME) + 1e-9)[1:].all())
                for factor in (1.0, 0.99)
            ]
            assert held[0]
            assert not held[1] or distance[n, base] <= 1e-6


def test_many_segments_are_measured_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    basis, segments = manoeuvres(), random_segments(10, 1)
    whole = body_radius(basis, segments)
    monkeypatch.setattr("coverdrive.prediction.data.parts.PART", 3)
    assert np.array_equal(body_radius(basis, segments), whole)
    assert body_radius(basis, segments.of(np.arange(0))).shape == (0, 3)


def test_a_mirror_image_is_as_far_from_the_mirror_image_of_a_base() -> None:
    basis, segments = manoeuvres(), random_segments(10, 2)
    mirrored = replace(basis, points=basis.points * [1.0, -1.0])
    assert body_radius(mirrored, segments.mirrored) == pytest.approx(body_radius(basis, segments))


def test_samples_are_as_far_away_as_centre_and_body(scenes: tuple[Recording, ...]) -> None:
    segments = cut_segments(scenes, SegmentSettings(stride=1.0))
    turned = replace(segments, heading=segments.heading + 0.3)
    for each in (segments, turned):
        distance = make_samples(scenes, each, manoeuvres()).distance
        centre, body = manoeuvres().distance(each.points), body_radius(manoeuvres(), each)
        assert np.array_equal(distance, np.maximum(centre, body))
    assert (body > centre).any()


@pytest.mark.parametrize("slowly", [False, True])
def test_who_is_covered_stays_in_the_boxes_that_are_predicted(slowly: bool) -> None:
    """The whole body, at every point of the segment; and the centre in the ellipses."""
    basis = manoeuvres()
    network = Network.create(np.zeros((1, 21), np.float32), (4,), len(basis), np.random.default_rng(0))
    rule = Thresholds(np.zeros(3), np.full(3, basis.radius))
    certificate = Certificate("test", 0.1, 0.9, 10, "window", 3, 0, 0, 0, tube=0.5, fingerprint="")
    predictor = Predictor(basis, network, rule, certificate, np.zeros(0, int))
    random = np.random.default_rng(0)
    held = outside = 0
    for segments in (random_segments(30, seed) for seed in range(10)):
        made = replace(segments, speed=random.uniform(0, 3, len(segments))) if slowly else segments
        lon = made.points[..., 0] + made.speed[:, None] * TIME
        driven = np.stack([np.maximum.accumulate(lon, axis=1), made.points[..., 1]], axis=-1)  # nobody goes backwards
        made = replace(made, points=driven - made.speed[:, None, None] * TIME[:, None] * [1.0, 0.0])
        radius = np.maximum(basis.distance(made.points), body_radius(basis, made))
        for n in range(len(made)):
            length, width = 2 * made.half_sizes[n]
            size = np.ones(1)
            scene = Scene(0 * size, 5.4 * size, made.speed[n] * size, 0 * size, length * size, width * size, size > 0)
            pair = jax.tree.map(lambda values: np.concatenate([values, values]), scene)
            paths = predictor.predict(pair, Road.straight(), 1, 0.5, 6)
            body = turned_half_extents(made.half_sizes[n, None], made.heading[n])
            apart = driven[n] + [0.0, 5.4] - paths.points
            in_box = (np.abs(apart) + body <= paths.half_sizes + 1e-6)[:, 1:].all((1, 2))
            in_ellipse = ((apart / paths.ellipses) ** 2).sum(-1)[:, 1:].max(1) <= 1 + 1e-6
            covered = radius[n] <= basis.radius
            assert (in_box & in_ellipse)[covered].all()
            held, outside = held + covered.sum(), outside + (~in_box).sum()
    assert held > 10 and outside > 100
