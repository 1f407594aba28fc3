"""Collision check and labels, by hand and against a plain loop."""

import numpy as np
import polars as pl
import pytest
from prediction_fakes import described

from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.data.segments import SegmentSettings, cut_segments
from coverdrive.prediction.learning.samples import (
    COLLIDES,
    OTHER,
    POSSIBLE,
    body_radius,
    colliding_bases,
    make_features,
    make_samples,
)
from coverdrive.prediction.stored import SLOTS, features_of
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road
from coverdrive.scene import Scene

TIME = 0.5 * np.arange(7)


def manoeuvres() -> Basis:
    """Keep on; brake at 4 m/s²; move 3.6 m to the left; move 3.6 m to the right."""
    shift = 3.6 * (1 - np.cos(np.pi * TIME / 3)) / 2
    points = np.zeros((4, 7, 2))
    points[1, :, 0] = -2 * TIME**2
    points[2, :, 1], points[3, :, 1] = shift, -shift
    return Basis(points, radius=0.5, aspect=4.0, growth=1.0, step=0.5)


def scene_of(*vehicles: tuple[float, float, float]) -> Scene:
    """One scene, with a batch axis, of vehicles given as lon, lat, speed; 4.8 m × 1.9 m each."""
    lon, lat, speed = np.array(vehicles, dtype=np.float32).T[:, None]
    size = np.ones_like(lon)
    return Scene(lon, lat, speed, 0 * lon, 4.8 * size, 1.9 * size, np.ones(lon.shape, dtype=bool))


@pytest.mark.parametrize(
    ("other", "hit"),
    [
        ((60.0, 5.4, 20.0), [False, False, False, False]),
        ((20.0, 5.4, 10.0), [True, False, False, False]),  # slower, ahead: braking or leaving the lane helps
        ((-15.0, 5.4, 20.0), [False, True, False, False]),  # behind: braking is what collides
        ((0.0, 9.0, 20.0), [False, False, True, False]),
        ((0.0, 1.8, 20.0), [False, False, False, True]),
        ((-25.0, 9.0, 30.0), [False, False, True, False]),  # comes up fast from behind on the left
    ],
)
def test_which_manoeuvres_collide(other: tuple[float, float, float], hit: list[bool]) -> None:
    assert np.asarray(colliding_bases(manoeuvres(), scene_of((0, 5.4, 20), other), np.array([0])))[0].tolist() == hit


def test_empty_slots_and_the_own_car_do_not_collide() -> None:
    scene = scene_of((0, 5.4, 20), (10, 5.4, 0))
    alone = Scene(
        scene.lon, scene.lat, scene.speed, scene.heading, scene.length, scene.width, np.array([[True, False]])
    )
    assert not np.asarray(colliding_bases(manoeuvres(), alone, np.array([0]))).any()


def plain_collisions(basis: Basis, scene: Scene, own: int) -> list[bool]:
    result, rolled = [], [(time, basis.rollout(np.array([time]))[0]) for time in np.arange(0.25, 3.01, 0.25)]
    for base in range(len(basis)):
        hit = False
        for time, deviations in rolled:
            deviation = deviations[base, 0]
            lon = scene.lon[own] + scene.speed[own] * np.cos(scene.heading[own]) * time + deviation[0]
            lat = scene.lat[own] + deviation[1]
            for other in range(scene.vehicles):
                if other != own and scene.valid[other]:
                    there = scene.lon[other] + scene.speed[other] * np.cos(scene.heading[other]) * time
                    hit |= bool(
                        abs(there - lon) < (scene.length[own] + scene.length[other]) / 2
                        and abs(scene.lat[other] - lat) < (scene.width[own] + scene.width[other]) / 2
                    )
        result.append(hit)
    return result


def test_agrees_with_the_plain_loop() -> None:
    random = np.random.default_rng(0)
    batch, vehicles = 40, 6
    shape = (batch, vehicles)
    scene = Scene(
        random.uniform(-40, 40, shape),
        random.uniform(0, 10.8, shape),
        random.uniform(10, 30, shape),
        random.normal(0, 0.05, shape),
        random.uniform(4, 12, shape),
        random.uniform(1.7, 2.5, shape),
        random.random(shape) < 0.8,
    )
    own = random.integers(0, vehicles, batch)
    actual = np.asarray(colliding_bases(manoeuvres(), scene, own))
    fields = ("lon", "lat", "speed", "heading", "length", "width", "valid")
    for i in range(batch):
        one = Scene(**{name: getattr(scene, name)[i] for name in fields})
        assert actual[i].tolist() == plain_collisions(manoeuvres(), one, own[i])
    assert 0.1 < actual.mean() < 0.9


def test_labels(scenes: tuple[Recording, ...]) -> None:
    segments = cut_segments(scenes, SegmentSettings(stride=1.0))
    basis = manoeuvres()
    samples = make_samples(scenes, segments, basis, "nearest")
    assert len(samples) == len(segments)
    assert set(np.unique(samples.labels)) <= {POSSIBLE, OTHER, COLLIDES}
    assert ((samples.labels == POSSIBLE).sum(1) == 1).all()
    distance = basis.distance(segments.points)
    assert np.array_equal(samples.base, distance.argmin(1))
    assert np.array_equal(samples.distance, np.maximum(distance, body_radius(basis, segments)))
    for i in range(0, len(samples), 37):
        recording = scenes[segments.recording[i]]
        row = recording.table.row(int(segments.row[i]), named=True)
        scene = recording.scene_at(row["time"])
        own = int(np.flatnonzero(np.isclose(scene.lon, row["lon"]) & np.isclose(scene.lat, row["lat"]))[0])
        expected = np.where(plain_collisions(basis, scene, own), COLLIDES, OTHER)
        expected[samples.base[i]] = POSSIBLE
        assert samples.labels[i].tolist() == expected.tolist()
        assert samples.features[i, 0] == pytest.approx(row["speed"], rel=1e-5)


def test_features_are_those_of_the_scene_in_which_a_segment_starts(scenes: tuple[Recording, ...]) -> None:
    segments = cut_segments(scenes, SegmentSettings(stride=1.0))
    order = np.random.default_rng(0).permutation(len(segments))
    features = make_features(scenes, segments.of(order))
    for i, place in enumerate(order[::19]):
        recording = scenes[segments.recording[place]]
        row = recording.table.row(int(segments.row[place]), named=True)
        scene = recording.scene_at(row["time"])
        own = np.flatnonzero(np.isclose(scene.lon, row["lon"]) & np.isclose(scene.lat, row["lat"]))
        assert np.array_equal(features[19 * i], described(scene, recording.road.edges)[own[0]])
        padded = features_of(scene, recording.road, own)
        assert len(padded) == SLOTS and np.array_equal(padded[0], features[19 * i]) and not padded[1:].any()
    assert not features_of(scene, recording.road, own[:0]).any()


def test_the_first_base_that_covers_stands_for_a_segment(scenes: tuple[Recording, ...]) -> None:
    segments = cut_segments(scenes, SegmentSettings(stride=1.0))
    points = np.concatenate([segments.points[:3], np.zeros((1, 7, 2))])
    basis = Basis(points, radius=1.0, aspect=4.0, growth=1.0, step=0.5)
    samples = make_samples(scenes, segments, basis)
    for distance, base in zip(samples.distance, samples.base, strict=True):
        covering = [index for index in range(4) if distance[index] <= 1.0]
        assert not covering or base == covering[0]
    nearest = basis.distance(segments.points).argmin(1)
    uncovered = (samples.distance > 1.0).all(1)
    assert uncovered.any() and (samples.base[uncovered] == nearest[uncovered]).all()
    assert (samples.base != nearest).any()


def test_mirror_images_are_those_of_the_mirrored_recording(scenes: tuple[Recording, ...]) -> None:
    """Mirroring the recording by hand, with the basis as it is, gives the same samples."""
    segments = cut_segments(scenes, SegmentSettings(stride=1.0))
    by_hand = tuple(
        Recording(
            recording.name,
            recording.table.select(SCHEMA.names()).with_columns(
                pl.col("lat").neg() + float(recording.road.edges[-1]), pl.col("heading").neg()
            ),
            recording.dt,
            Road(recording.road.edges[-1] - recording.road.edges[::-1], recording.road.length),
            {},
        )
        for recording in scenes
    )
    mirrored = make_samples(scenes, segments, manoeuvres(), mirrored=True)
    expected = make_samples(by_hand, cut_segments(by_hand, SegmentSettings(stride=1.0)), manoeuvres())
    assert mirrored.features == pytest.approx(expected.features, abs=2e-3)
    assert (mirrored.collides == expected.collides).mean() > 0.999
    assert mirrored.distance == pytest.approx(expected.distance, abs=1e-5)
