"""Edges hold the body, and contacts and speeds in closed form are those of dense sampling."""

import numpy as np
import pytest
from planning_scenes import CAR, CONSTANTS, DT, STEPS, drive, driven, sampled, wishes

from coverdrive.geometry import boxes_overlap, turned_half_extents
from coverdrive.planning.check.sweep import NEVER, contact_at, impact, impact_beyond, may_touch, write_edges
from coverdrive.planning.problem.rollout import after_step
from coverdrive.planning.problem.vehicle import step


def within_limits(rng: np.random.Generator, plans: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A state, and inputs and states of plans from there within the limits of the ego."""
    state = np.array([0.0, 5.0, rng.uniform(0, 45), rng.uniform(-0.3, 0.3)])
    states, inputs = drive(state, wishes(rng, plans, STEPS))
    return state, inputs, states


@pytest.mark.parametrize("parts", [1, 5, 25])
def test_edges_hold_the_body_by_whatever_finer_steps_it_is_driven(parts: int) -> None:
    tightest = np.inf
    for seed in range(20):
        state, inputs, states = within_limits(np.random.default_rng(seed), 5)
        _, finer = driven(state, inputs, parts)
        own = sampled(finer, 50 // parts)
        extent = turned_half_extents(CAR.half_sizes, own[..., 3])
        body = np.concatenate([own[..., :2] - extent, own[..., :2] + extent], axis=-1)
        for i in range(len(inputs)):
            edges = np.empty((STEPS, 2, 4))
            write_edges(states[i], inputs[i], edges, CONSTANTS)
            share = np.arange(51)[:, None] / 50
            for k in range(STEPS):
                between = edges[k, 0] + share * (edges[k, 1] - edges[k, 0])
                inside = (body[i, 50 * k : 50 * (k + 1) + 1] - between) * [1, 1, -1, -1]
                assert inside.min() >= -1e-9
                tightest = min(tightest, inside.min())
    assert tightest < 0.01


def test_edges_and_boxes_may_touch_where_dense_sampling_finds_it() -> None:
    rng, share, met = np.random.default_rng(0), np.linspace(0, 1, 2001), 0
    for _ in range(400):
        centre, half = rng.uniform(-3, 3, (2, 2)), rng.uniform(0.1, 2, (2, 2))
        edges = np.concatenate([centre - half, centre + half], axis=1)[None]
        boxes = np.zeros((7, 2, 1))
        boxes[:2, :, 0], boxes[2:4, :, 0] = rng.uniform(-3, 3, (2, 2)), rng.uniform(0.1, 2, (2, 2))
        known = np.concatenate([boxes[:2, :, 0] - boxes[2:4, :, 0], boxes[:2, :, 0] + boxes[2:4, :, 0]]).T
        own, other = (np.stack([np.interp(share, [0, 1], at) for at in each.T]) for each in (edges[0], known))
        met += (overlap := bool(((own[:2] < other[2:]) & (other[:2] < own[2:])).all(0).any()))
        assert may_touch(edges, boxes, 0, 0) is overlap
    assert 80 < met < 360


@pytest.mark.parametrize("grown", [0.0, 0.5, 1.0])
def test_first_contact_of_the_turned_body_is_that_of_dense_sampling(grown: float) -> None:
    """Never late by a look, but for contacts that are over by then; and the upright box is met more often."""
    rng, share, met, upright, late = np.random.default_rng(0), np.linspace(0, 1, 201), 0, 0, list[float]()
    for _ in range(150):
        state = np.array([0.0, 0.0, rng.uniform(5, 40), rng.uniform(-0.35, 0.35)])
        applied = np.array([rng.uniform(-8, 3), rng.uniform(-0.2, 0.2)])
        boxes = np.zeros((7, 2, 1))
        boxes[:2, :, 0] = rng.uniform([-8, -4], [15, 4], (2, 2)).T
        boxes[2:4, 0, 0] = rng.uniform(0.1, 2, 2)
        boxes[2:4, 1, 0] = boxes[2:4, 0, 0] + rng.uniform(0, 1, 2)
        own = np.array([after_step(tuple(state), tuple(applied), at * DT) for at in share])
        size = boxes[2:4, :1, 0] + grown * (boxes[2:4, :, 0] - boxes[2:4, :1, 0])
        centre, half = (np.stack([np.interp(share, [0, 1], at) for at in each], -1) for each in (boxes[:2, :, 0], size))
        overlap = boxes_overlap(own[:, :2], own[:, 3], CAR.half_sizes, centre, np.zeros(1), half)
        got, _ = contact_at(tuple(state), tuple(applied), boxes, 0, 0, grown, 0.0, CONSTANTS)
        extent = turned_half_extents(CAR.half_sizes, own[:, 3])
        upright += (np.abs(own[:, :2] - centre) < extent + half).all(-1).any()
        if overlap.sum() > 20:
            met += 1
            late.append(got - share[np.argmax(overlap)])
        elif not overlap.any():
            assert got == NEVER
    assert 30 < met < upright
    assert min(late) > -0.01 and max(late) < 0.1
    assert np.median(np.abs(late)) < 0.01


def test_time_of_contact_by_hand() -> None:
    """At 20 m/s towards a standing box 2 m ahead: after 2 of the 5 m of the step, and 1 m deep in it after 3."""
    boxes, state = np.zeros((7, 13, 2)), (0.0, 0.0, 20.0, 0.0)
    boxes[0], boxes[2], boxes[3] = [6.8, 60.0], 2.4, 0.95
    assert contact_at(state, (0.0, 0.0), boxes, 0, 0, 1.0, 0.0, CONSTANTS) == (pytest.approx(0.4), False)
    assert contact_at(state, (0.0, 0.0), boxes, 0, 0, 1.0, 1.0, CONSTANTS) == (pytest.approx(0.6), False)
    assert contact_at(state, (0.0, 0.0), boxes, 0, 0, 1.0, 1.95, CONSTANTS) == (NEVER, False)  # it is not that wide
    assert contact_at(state, (0.0, 0.0), boxes, 0, 1, 1.0, 0.0, CONSTANTS) == (NEVER, False)
    assert contact_at((5.0, 0.0, 20.0, 0.0), (0.0, 0.0), boxes, 1, 0, 1.0, 0.0, CONSTANTS) == (0.0, False)


def test_a_turned_body_passes_what_the_upright_box_around_it_meets() -> None:
    """Debris beside the front of a car that is turned away from it: 10 cm to spare, within its upright box."""
    state, boxes, edges = np.array([0.0, 0.0, 20.0, 0.3]), np.zeros((7, 2, 1)), np.empty((1, 2, 4))
    side, ahead = np.array([np.sin(0.3), -np.cos(0.3)]), np.array([np.cos(0.3), np.sin(0.3)])
    boxes[:2, :, 0] = ((0.95 + 0.1 + 0.1 * (np.sin(0.3) + np.cos(0.3))) * side - 1.0 * ahead)[:, None]
    boxes[2:4] = 0.1
    boxes[:2, 1, 0] += DT * 20.0 * ahead  # it goes along
    states = np.stack([state, step(state, np.zeros(2), DT)])
    write_edges(states, np.zeros((1, 2)), edges, CONSTANTS._replace(steps=1))
    assert may_touch(edges, boxes, 0, 0)
    assert contact_at(tuple(state), (0.0, 0.0), boxes, 0, 0, 1.0, 0.0, CONSTANTS) == (NEVER, False)
    boxes[2:4] = 0.2
    assert contact_at(tuple(state), (0.0, 0.0), boxes, 0, 0, 1.0, 0.0, CONSTANTS)[0] == 0


@pytest.mark.parametrize(
    ("box", "way", "behind"),
    [
        ((-10.0, 0.5), (6.0, 0.0), True),  # drives into the rear
        ((-4.0, 2.5), (0.0, -1.0), False),  # comes over from beside, though most of it is behind
        ((-4.0, 2.5), (0.5, -1.0), False),  # faster as well
        ((10.0, 0.5), (-6.0, 0.0), False),  # the ego drives into it
    ],
)
def test_who_comes_over_from_beside_does_not_come_from_behind(
    box: tuple[float, float], way: tuple[float, float], behind: bool
) -> None:
    boxes = np.zeros((7, 2, 1))
    boxes[:2, :, 0], boxes[2], boxes[3] = np.transpose([box, np.add(box, way)]), 2.4, 0.95
    share, got = contact_at((0.0, 0.0, 0.0, 0.0), (0.0, 0.0), boxes, 0, 0, 1.0, 0.0, CONSTANTS)
    assert 0 < share < 1
    assert got is behind


@pytest.mark.parametrize("k", [0, 5, 11])
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_relative_speed_to_a_box_that_brakes_and_swerves_evenly(k: int, share: float) -> None:
    time, boxes = DT * np.arange(13), np.zeros((7, 13, 1))
    boxes[0, :, 0], boxes[1, :, 0] = 20 * time - 3 * time**2, 5 - 2 * time + time**2
    at = (k + share) * DT
    speed, heading = 30 + share * DT * 2.0, 0.1 - share * DT * 0.2
    expected = np.hypot(speed * np.cos(heading) - (20 - 6 * at), speed * np.sin(heading) - (-2 + 2 * at))
    assert impact((0.0, 0.0, 30.0, 0.1), (2.0, -0.2), share, boxes, k, 0, DT) == pytest.approx(expected)


def beyond(speed: float, other: float, fall: float, way: float, lat: float = 0.0) -> float:
    """`impact_beyond` of an ego [m/s] whose front is a way [m] behind the rear of a box that goes on at ``other``."""
    boxes = np.zeros((7, 13, 1))
    boxes[:6, -1, 0] = [100.0 + way + 2.3, lat, 2.3, 0.9, other, fall]
    edges = np.array([100.0 - 4.8, -0.95, 100.0, 0.95])
    return impact_beyond((97.6, 0.0, speed, 0.0), edges, boxes, 0, 8.0)


def test_contact_beyond_the_end_is_that_of_two_that_brake() -> None:
    rng, time, met, missed = np.random.default_rng(1), np.linspace(0, 12, 120_001), 0, 0

    def gone(speed: float, braking: float) -> tuple[np.ndarray, np.ndarray]:
        """Way and speed over the time."""
        until = np.minimum(time, speed / max(braking, 1e-12))
        return speed * until - braking / 2 * until**2 + (speed * (time - until) if braking == 0 else 0.0), (
            speed - braking * until
        )

    for _ in range(300):
        speed, other, way = rng.uniform(0, 45), rng.uniform(0, 45), rng.uniform(0, 60) * rng.choice([0.1, 1.0])
        fall = rng.choice([0.0, rng.uniform(0, 8), 8.0, 12.0])
        (own, own_speed), (ahead, other_speed) = gone(speed, 8.0), gone(other, min(fall, 8.0))
        gap = way + ahead - own
        got = beyond(speed, other, fall, way)
        if abs(gap.min()) < 1e-3:
            continue
        if gap.min() < 0:
            met += 1
            first = np.argmax(gap < 0)
            assert got == pytest.approx(own_speed[first] - other_speed[first], abs=0.01 + 0.2 / max(got, 0.1))
        else:
            missed += 1
            assert got == -1.0
    assert met > 50 and missed > 50


def test_whoever_is_beside_or_behind_is_not_met_beyond_the_end() -> None:
    assert beyond(30.0, 5.0, 0.0, 5.0) > 0
    assert beyond(30.0, 5.0, 0.0, 5.0, lat=1.86) == -1.0
    assert beyond(30.0, 5.0, 0.0, -10.0) == -1.0
    assert beyond(5.0, 30.0, 0.0, 5.0) == -1.0
