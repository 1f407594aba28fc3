"""A motion that is called clear touches nothing at any time, by whatever steps it is driven; sampled densely."""

import numpy as np
import pytest

from coverdrive.geometry import boxes_overlap
from coverdrive.planning.constants import constants_of
from coverdrive.planning.evaluate import evaluate, surroundings_of
from coverdrive.planning.obstacles import FAR, Obstacles
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.sweep import contact_at, write_edges
from coverdrive.planning.vehicle import VehicleSettings, step

PROBLEM, CAR = ProblemSettings(), VehicleSettings()
CONSTANTS, STEPS, DT = constants_of(PROBLEM), 12, 0.25


def scene(rng: np.random.Generator) -> Situation:
    """A car among others of all sizes that stand, drive, cross, come from behind or towards it, and swerve."""
    speed, vehicles, time = rng.uniform(0, 45), 3, DT * np.arange(STEPS + 1)
    state = np.array([0.0, rng.uniform(1.0, 9.8), speed, rng.uniform(-0.2, 0.2)])
    along = np.where(rng.random(vehicles) < 0.3, 0.0, rng.uniform(-45, 45, vehicles))
    across = np.where(rng.random(vehicles) < 0.6, 0.0, rng.uniform(-10, 10, vehicles))
    meeting = rng.uniform(0, 3, vehicles)  # when it would be where the car is, but for some metres
    lon = (speed - along) * meeting + rng.uniform(-30, 30, vehicles)
    lat = state[1] - across * meeting + rng.uniform(-6, 6, vehicles)
    swerve = rng.normal(0, 0.2, (len(time), vehicles, 2)).cumsum(0)
    centres = np.stack([lon + along * time[:, None], lat + across * time[:, None]], axis=-1) + swerve
    half_sizes = rng.choice([[1.1, 0.4], [2.3, 0.9], [6.0, 1.3]], vehicles) + 0.05 * np.arange(13)[:, None, None]
    speeds = np.full((STEPS + 1, vehicles), FAR)
    return Situation(
        state,
        np.zeros(2),
        (-5.0, 15.8),
        Obstacles(centres, half_sizes, speeds, np.zeros_like(speeds), np.ones_like(speeds)),
    )


def wishes(rng: np.random.Generator, motions: int) -> np.ndarray:
    return np.concatenate([rng.normal(0, 5, (motions, STEPS)), rng.normal(0, 0.2, (motions, STEPS))], axis=1)


def driven(state: np.ndarray, inputs: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and states of motions (m, 12, 2) by steps of dt / parts."""
    states = [np.repeat(state[None], len(inputs), axis=0)]
    for k in range(STEPS):
        for _ in range(parts):
            states.append(step(states[-1], inputs[:, k], DT / parts))
    return DT / parts * np.arange(len(states)), np.stack(states, axis=1)


def touches(time: np.ndarray, states: np.ndarray, obstacles: Obstacles, samples: int) -> np.ndarray:
    """Which motions touch a box at any of some samples between two states, in which all move evenly."""
    at = np.linspace(0, time[-1], (len(time) - 1) * samples + 1)
    own = np.stack([[np.interp(at, time, column) for column in each.T] for each in states]).swapaxes(1, 2)
    known = DT * np.arange(STEPS + 1)
    points, half_sizes = (
        np.stack([[np.interp(at, known, each[:, slot, axis]) for axis in range(2)] for slot in range(each.shape[1])])
        for each in (obstacles.centres, obstacles.half_sizes)
    )
    points, half_sizes = points.transpose(2, 0, 1)[None], half_sizes.transpose(2, 0, 1)[None]
    heading = np.zeros(points.shape[:-1])
    own = own[:, :, None]
    return boxes_overlap(own[..., :2], own[..., 3], CAR.half_sizes, points, heading, half_sizes).any((1, 2))


def clear_and_touching(seeds: range, motions: int) -> tuple[int, int, int]:
    """Of motions in random scenes: how many there are, are called clear, and touch a box although they are."""
    total = clear = touching = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        situation = scene(rng)
        got = evaluate(wishes(rng, motions), np.full(motions, 5.4), surroundings_of(situation), CONSTANTS)
        inputs = np.swapaxes(got.inputs.reshape(motions, 2, STEPS), 1, 2)[got.clear]
        total, clear = total + motions, clear + len(inputs)
        for parts, samples in ((1, 20), (5, 4), (25, 1)) if len(inputs) else ():
            touching += int(touches(*driven(situation.state, inputs, parts), situation.obstacles, samples).sum())
    return total, clear, touching


def test_what_is_called_clear_touches_nothing() -> None:
    total, clear, touching = clear_and_touching(range(300), 10)
    assert touching == 0
    assert 0.1 * total < clear < 0.9 * total


@pytest.mark.slow
def test_what_is_called_clear_touches_nothing_in_many_scenes() -> None:
    _, clear, touching = clear_and_touching(range(1000, 11_000), 10)
    assert touching == 0
    assert clear > 10_000


def test_samples_alone_would_miss_contacts() -> None:
    """The negative control: of motions whose states touch nothing, some do in between, and none of these is clear."""
    missed = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        situation = scene(rng)
        got = evaluate(wishes(rng, 10), np.full(10, 5.4), surroundings_of(situation), CONSTANTS)
        inputs = np.swapaxes(got.inputs.reshape(10, 2, STEPS), 1, 2)
        time, states = driven(situation.state, inputs, 1)
        missing = ~touches(time, states, situation.obstacles, 1) & touches(time, states, situation.obstacles, 20)
        assert not (missing & got.clear).any()
        missed += missing.sum()
    assert missed > 20


def test_a_car_beside_another_of_its_speed_needs_no_more_room_than_its_body() -> None:
    """Neither moves against the other: a gap of a millimetre is clear, none is not."""
    time = DT * np.arange(STEPS + 1)
    for gap, clear in ((0.001, True), (-0.001, False)):
        centres = np.stack([20.0 * time, np.full(13, 5.4 - 1.9 - gap)], axis=-1)[:, None]
        speeds = np.full((13, 1), FAR)
        obstacles = Obstacles(centres, np.tile([2.4, 0.95], (13, 1, 1)), speeds, np.zeros((13, 1)), np.ones((13, 1)))
        situation = Situation(np.array([0.0, 5.4, 20.0, 0.0]), np.zeros(2), (0.0, 10.8), obstacles)
        got = evaluate(np.zeros((1, 24)), np.array([5.4]), surroundings_of(situation), CONSTANTS)
        assert bool(got.clear[0]) is clear


def test_time_of_contact_by_hand() -> None:
    """At 20 m/s towards a standing box 2 m ahead: after 2 of the 5 m of the step."""
    states, inputs = np.zeros((13, 4)), np.zeros(24)
    states[:, 0], states[:, 2] = 5.0 * np.arange(13), 20.0
    edges = np.empty((12, 2, 4))
    write_edges(states, inputs, edges, CONSTANTS)
    boxes = np.zeros((7, 13, 2))
    boxes[0], boxes[2], boxes[3] = [6.8, 60.0], 2.4, 0.95
    assert contact_at(edges, boxes, 0, 0, 0.0) == pytest.approx(0.4)
    assert contact_at(edges, boxes, 0, 1, 0.0) > 1
    assert contact_at(edges, boxes, 1, 0, 0.0) == 0.0
