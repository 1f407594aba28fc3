"""The 21 features on hand-drawn scenes, against a plain loop, and under permutation and mirroring."""

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from prediction_fakes import described

from coverdrive.prediction.learning.affordance import (
    FEATURES,
    MOTION,
    affordance,
    described_at,
    mirrored_features,
)
from coverdrive.road import Road
from coverdrive.scene import Scene
from ramp_road import RAMP

ROAD = Road.straight(lanes=3, width=3.6)
Vehicle = tuple[float, float, float, float, float]


def scene_of(*vehicles: Vehicle) -> Scene:
    """A scene from tuples of lon, lat, speed, length, width."""
    lon, lat, speed, length, width = np.array(vehicles, dtype=np.float32).T
    return Scene(lon, lat, speed, np.zeros_like(lon), length, width, np.ones(len(lon), dtype=bool))


def named(scene: Scene, slot: int = 0, road: Road = ROAD) -> dict[str, float]:
    return dict(zip(FEATURES, affordance(scene, road.edges)[slot].tolist(), strict=True))


def expect(actual: Mapping[str, float], **expected: float) -> None:
    for name, value in expected.items():
        assert actual[name.replace("_", " ")] == pytest.approx(value, abs=1e-4), name


def test_there_are_21_features() -> None:
    assert len(FEATURES) == len(set(FEATURES)) == 21


def test_empty_road_in_the_middle_lane() -> None:
    features = named(scene_of((0, 5.5, 20, 4, 2)))
    expect(features, speed=20, distance_to_lane_centre=0.1, front_clearance=50, front_relative_speed=0, own_length=4)
    for side in ("left", "right"):
        for end in ("front", "rear"):
            expect(features, **{f"{side}_{end}_clearance": 50, f"{side}_{end}_lateral_clearance": 3.6})
            expect(features, **{f"{side}_{end}_relative_speed": 0, f"{side}_{end}_length": 0})


def test_rightmost_lane_has_no_lane_on_its_right() -> None:
    features = named(scene_of((0, 1.5, 20, 4, 2)))
    for end in ("front", "rear"):
        expect(features, **{f"right_{end}_clearance": 0, f"right_{end}_lateral_clearance": 0.5})
        expect(features, **{f"left_{end}_clearance": 50, f"left_{end}_lateral_clearance": 3.6})


def test_all_neighbours_of_the_middle_lane() -> None:
    features = named(
        scene_of(
            (100, 5.4, 20, 4, 2),
            (125, 5.4, 18, 5, 2),  # ahead: 25 − 4.5
            (160, 5.4, 10, 5, 2),  # ahead, hidden
            (110, 9.2, 25, 6, 2),  # left front: 10 − 5; across 3.8 − 2
            (91, 8.8, 30, 4.4, 1.8),  # left rear: 9 − 4.2; across 3.4 − 1.9
            (103, 1.8, 19, 4, 2),  # right front, alongside: 3 − 4
            (40, 2.0, 21, 12, 2.5),  # right rear: clipped
        )
    )
    expect(features, front_clearance=20.5, front_relative_speed=-2)
    expect(features, left_front_clearance=5, left_front_relative_speed=5, left_front_lateral_clearance=1.8)
    expect(features, left_rear_clearance=4.8, left_rear_relative_speed=10, left_rear_lateral_clearance=1.5)
    expect(features, right_front_clearance=-1, right_front_relative_speed=-1, right_front_lateral_clearance=1.6)
    expect(features, right_rear_clearance=50, right_rear_relative_speed=1, right_rear_lateral_clearance=1.15)
    expect(features, left_front_length=6, left_rear_length=4.4, right_front_length=4, right_rear_length=12)


def test_vehicle_two_lanes_away_is_no_neighbour() -> None:
    features = named(scene_of((0, 1.8, 20, 4, 2), (10, 9.0, 25, 4, 2)))
    expect(features, left_front_clearance=50, left_front_length=0)


def test_empty_slots_do_not_count() -> None:
    scene = scene_of((0, 5.4, 20, 4, 2), (20, 5.4, 10, 4, 2))
    hidden = Scene(
        *(getattr(scene, name) for name in ("lon", "lat", "speed", "heading", "length", "width")),
        valid=np.array([True, False]),
    )
    expect(named(hidden), front_clearance=50, front_relative_speed=0)


def test_equally_near_neighbours_do_not_depend_on_their_order() -> None:
    own, left, twin = (0, 5.4, 20, 4, 2), (20, 9.0, 25, 4, 2), (20, 9.0, 22, 4, 1.8)
    assert named(scene_of(own, left, twin)) == named(scene_of(own, twin, left))


@st.composite
def traffic(draw: st.DrawFn) -> Scene:
    count = 9  # slots, of which some are empty: every other number would be compiled again
    lon = st.floats(-80, 80, width=32, allow_subnormal=False)
    lane = st.sampled_from([1.8, 5.4, 9.0])
    offset = st.floats(-1.5, 1.5, width=32)
    rows = [
        (
            draw(lon),
            draw(lane) + draw(offset),
            draw(st.floats(0, 40, width=32)),
            draw(st.floats(3, 15, width=32)),
            draw(st.floats(1.5, 2.5, width=32)),
        )
        for _ in range(count)
    ]
    scene = scene_of(*rows)
    valid = np.array(draw(st.lists(st.booleans(), min_size=count, max_size=count)))
    return Scene(scene.lon, scene.lat, scene.speed, scene.heading, scene.length, scene.width, valid)


@settings(deadline=None, max_examples=60)
@given(traffic(), st.randoms(use_true_random=False))
def test_permuting_the_vehicles_permutes_the_rows(scene: Scene, random) -> None:
    order = list(range(scene.vehicles))
    random.shuffle(order)
    fields = ("lon", "lat", "speed", "heading", "length", "width", "valid")
    permuted = Scene(**{name: getattr(scene, name)[order] for name in fields})
    assert np.array_equal(affordance(permuted, ROAD.edges), affordance(scene, ROAD.edges)[order])


@settings(deadline=None, max_examples=60)
@given(traffic())
def test_mirroring_the_road_exchanges_left_and_right(scene: Scene) -> None:
    def swapped(name: str) -> str:
        return name.replace("left", "?").replace("right", "left").replace("?", "right")

    plain, mirrored = described(scene, ROAD.edges), described(scene.mirrored(), ROAD.mirrored().edges)
    columns = [FEATURES.index(swapped(name)) for name in FEATURES]
    expected = np.concatenate([plain[:, columns], -plain[:, len(FEATURES) :]], axis=1)
    expected[:, FEATURES.index("distance to lane centre")] *= -1
    assert mirrored == pytest.approx(expected, abs=1e-4)
    assert np.array_equal(mirrored_features(plain), expected)
    assert np.array_equal(mirrored_features(mirrored_features(plain)), plain)


def test_some_slots_of_some_moments_have_the_features_that_all_have() -> None:
    random = np.random.default_rng(0)
    shape = (7, 6)
    along, across = random.uniform(0, 80, shape), random.uniform(0, 10.8, shape)
    scene = Scene(
        along, across, *random.uniform((5, -0.1, 4, 1.7), (30, 0.1, 6, 2), (7, 6, 4)).transpose(2, 0, 1),
        valid=random.random(shape) < 0.8,
    )  # fmt: skip
    edges = ROAD.edges_at(scene.lon)
    every = described(scene, edges)
    moment, slot = random.integers(0, (7, 6), (50, 2)).T  # in any order, some more than once
    assert np.array_equal(described_at(scene, edges, moment, slot), every[moment, slot])
    one = Scene(*(values[3] for values in vars(scene).values()))
    assert np.array_equal(described(one, ROAD.edges), every[3])


def test_lateral_speed_by_hand_and_in_the_mirror() -> None:
    scene = scene_of((0, 5.4, 20, 4, 2), (30, 5.4, 10, 4, 2))
    turned = Scene(
        scene.lon, scene.lat, scene.speed, np.array([np.pi / 6, 0.0]), scene.length, scene.width, scene.valid
    )
    seen = described(turned, ROAD.edges)
    assert seen.shape == (2, len(FEATURES) + len(MOTION))
    assert np.array_equal(seen[:, : len(FEATURES)], affordance(turned, ROAD.edges))
    assert seen[:, -1] == pytest.approx([10.0, 0.0])
    assert described(turned.mirrored(), ROAD.mirrored().edges)[:, -1] == pytest.approx([-10.0, 0.0])


def on_ramp_road(*vehicles: Vehicle) -> dict[str, float]:
    scene = scene_of(*vehicles)
    return dict(zip(FEATURES, affordance(scene, RAMP.edges_at(scene.lon))[0].tolist(), strict=True))


def test_a_lane_is_beside_a_vehicle_where_it_is_there() -> None:
    on_ramp = (150, 1.5, 15, 4, 2)
    before = on_ramp_road((108, 5.25, 20, 4, 2), on_ramp)  # the lane is 1.4 m wide there
    beside = on_ramp_road((130, 5.25, 20, 4, 2), on_ramp)
    expect(before, right_front_clearance=0, right_front_relative_speed=0, right_front_length=0)
    expect(before, right_front_lateral_clearance=5.25 - 1 - 2.1)  # to the edge of the road there
    expect(beside, right_front_clearance=16, right_front_relative_speed=-5, right_front_length=4)
    expect(before, left_front_clearance=50, left_front_lateral_clearance=3.6)
    mirrored = scene_of((130, 5.25, 20, 4, 2), on_ramp).mirrored()
    seen = affordance(mirrored, RAMP.mirrored().edges_at(mirrored.lon))[0]
    assert seen[FEATURES.index("left front clearance")] == pytest.approx(16)


def test_who_is_on_a_lane_that_has_ended_is_in_the_nearest_one_that_is_there() -> None:
    features = on_ramp_road((235, 2.0, 20, 4, 2), (260, 5.25, 18, 4, 2))
    expect(features, distance_to_lane_centre=2.0 - 5.25, front_clearance=21, front_relative_speed=-2)


def test_the_next_lane_is_the_one_behind_a_lane_in_the_middle_that_has_ended() -> None:
    edges = np.array([[0, 3.5, 3.5, 7.0], [0, 3.5, 3.5, 7.0], [0, 3.5, 7.0, 10.5]])
    scene = scene_of((0, 1.75, 20, 4, 2), (30, 5.25, 18, 5, 2), (90, 5.25, 18, 5, 2))
    features = dict(zip(FEATURES, affordance(scene, edges)[0].tolist(), strict=True))
    expect(features, left_front_clearance=30 - 4.5, left_front_length=5)


def test_edges_that_are_the_same_at_every_vehicle_are_those_of_the_road() -> None:
    scene = scene_of((0, 5.5, 20, 4, 2), (30, 1.7, 18, 5, 2), (-20, 9.0, 25, 12, 2.5))
    along = np.broadcast_to(ROAD.edges, (3, 4))
    assert np.array_equal(affordance(scene, along), affordance(scene, ROAD.edges))


def plain_affordance(scene: Scene, road: Road, own: int) -> list[float]:
    """The definition of the paper, one vehicle at a time."""
    lane_of = [int(sum(lat >= edge for edge in road.edges[1:-1])) for lat in scene.lat]
    lane = lane_of[own]

    def gap(other: int) -> float:
        return abs(scene.lon[other] - scene.lon[own]) - (scene.length[other] + scene.length[own]) / 2

    def neighbour(side: int, front: bool) -> tuple[float, float, float, float]:
        if not 0 <= lane + side < road.lanes:
            edge = road.edges[-1] - scene.lat[own] if side > 0 else scene.lat[own] - road.edges[0]
            return 0.0, 0.0, edge - scene.width[own] / 2, 0.0
        found = [
            other
            for other in range(scene.vehicles)
            if other != own
            and scene.valid[other]
            and lane_of[other] == lane + side
            and (scene.lon[other] >= scene.lon[own]) == front
        ]
        if not found:
            return 50.0, 0.0, 3.6, 0.0
        other = min(found, key=gap)
        lateral = abs(scene.lat[other] - scene.lat[own]) - (scene.width[other] + scene.width[own]) / 2
        return min(gap(other), 50.0), scene.speed[other] - scene.speed[own], lateral, scene.length[other]

    front, lf, lr = neighbour(0, True), neighbour(1, True), neighbour(1, False)
    rf, rr = neighbour(-1, True), neighbour(-1, False)
    return [
        scene.speed[own], scene.lat[own] - road.centres[lane], front[0], front[1],
        lf[0], lf[1], lf[2], lr[0], lr[2], lr[1], rf[0], rf[1], rf[2], rr[0], rr[2], rr[1],
        lf[3], lr[3], rf[3], rr[3], scene.length[own],
    ]  # fmt: skip


@settings(deadline=None, max_examples=80)
@given(traffic())
def test_agrees_with_the_plain_loop(scene: Scene) -> None:
    if len(set(scene.lon.tolist())) < scene.vehicles:
        return  # ties are tested above
    batch = Scene(
        **{name: getattr(scene, name)[None] for name in ("lon", "lat", "speed", "heading", "length", "width", "valid")}
    )
    expected = [plain_affordance(scene, ROAD, own) for own in range(scene.vehicles)]
    assert affordance(batch, ROAD.edges)[0] == pytest.approx(np.array(expected), abs=1e-3)
