"""Layers, members, prior and storage of the network, by hand."""

from typing import get_args

import numpy as np
import pytest

from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.prediction.learning.inputs import Inputs, network_inputs
from coverdrive.prediction.learning.network import Network

NEIGHBOURS = ("front", "left front", "right front", "left rear", "right rear")


def small(output: str, prior: float = 0.0) -> Network:
    """Two members on the 21 features, of which only the first two count; one hidden neuron, two bases."""
    weight = np.zeros((2, 1, 21), dtype=np.float32)
    weight[:, 0, :2] = [[1, -1], [0, 1]]
    last = np.array([[[3.0], [1.0]], [[-1.0], [1.0]]], dtype=np.float32)
    mean, scale = np.zeros(21, dtype=np.float32), np.ones(21, dtype=np.float32)
    mean[:2], scale[:2] = [1, 2], [2, 1]
    biases = (np.array([[0.5], [0.0]], dtype=np.float32), np.array([[-1.0, 0.0], [0.0, 0.0]], dtype=np.float32))
    return Network(mean, scale, (weight, last), biases, np.full(2, prior / 2, dtype=np.float32), "affordance", output)


FEATURES_OF_ONE = np.array([[5.0, 1.0] + [0.0] * 19], dtype=np.float32)
"""scaled: 2, −1; hidden: relu(2 + 1 + 0.5) = 3.5 and relu(−1) = 0; outputs (9.5, 3.5) and (0, 0)"""


def sigmoid(value: float) -> float:
    return 1 / (1 + np.exp(-value))


def test_members_are_averaged_after_the_sigmoid() -> None:
    network = small("sigmoid")
    assert network.scores_and_hidden(FEATURES_OF_ONE)[1] == pytest.approx(np.array([[3.5]]))
    expected = [(sigmoid(9.5) + 0.5) / 2, (sigmoid(3.5) + 0.5) / 2]
    assert network.scores(FEATURES_OF_ONE)[0] == pytest.approx(expected)


def test_softmax_and_prior() -> None:
    mixed = small("softmax", prior=0.4).scores(FEATURES_OF_ONE)[0]
    member = sigmoid(6.0)
    assert mixed == pytest.approx([0.6 * (member + 0.5) / 2 + 0.2, 0.6 * (1 - member + 0.5) / 2 + 0.2])


def test_rows_do_not_depend_on_each_other() -> None:
    features, network = np.random.default_rng(0).normal(size=(4, 21)).astype(np.float32), small("softmax", prior=0.2)
    assert network.scores_and_hidden(features)[1].shape == (4, 1)
    one_by_one = np.concatenate([network.scores(row[None]) for row in features])
    assert network.scores(features) == pytest.approx(one_by_one, abs=1e-6)


def test_what_is_stored_makes_the_same_network() -> None:
    network = small("softmax", prior=0.2)
    again = Network.of(network.arrays, network.kind)
    assert np.array_equal(again.scores(FEATURES_OF_ONE), network.scores(FEATURES_OF_ONE))


def features_of(**values: float) -> np.ndarray:
    row = np.zeros(21, dtype=np.float32)
    for name, value in values.items():
        row[FEATURES.index(name.replace("_", " "))] = value
    return row


def inputs_of(row: np.ndarray, inputs: Inputs) -> np.ndarray:
    return network_inputs(row[None], inputs)[0]


def test_inputs_of_each_kind_are_those_of_the_obvious_way() -> None:
    rows = np.random.default_rng(0).normal(8, 20, (50, 22)).astype(np.float32)
    named = dict(zip(FEATURES, rows.T, strict=False))
    speed, pairs, gaps = named["speed"], list[list[np.ndarray]](), list[np.ndarray]()
    for each in NEIGHBOURS:
        inverse = 1 / np.maximum(named[f"{each} clearance"], 1)
        nearing = named[f"{each} relative speed"] * (1 if "rear" in each else -1)
        pairs.append([inverse, np.clip(nearing, -10, 10) * inverse])
        gaps.append(np.clip(named[f"{each} clearance"] / np.maximum(speed, 1), -1, 5))
    offset, crawls = np.abs(named["distance to lane centre"]), (speed < 3).astype(np.float32)
    around = [column for pair, gap in zip(pairs, gaps, strict=True) for column in (*pair, gap)]
    derived = [*rows.T[:21], *around, offset, np.log1p(np.maximum(speed, 0)), crawls]
    faster = [named[f"{each} relative speed"] for each in NEIGHBOURS]
    urgent = [speed, named["distance to lane centre"], named["front clearance"], *faster, *pairs[0], gaps[0]]
    expected: dict[Inputs, list[np.ndarray]] = {
        "affordance": [*rows.T[:21]],
        "derived": derived,
        "motion": [*derived, rows.T[21]],
        "urgency": [*urgent, *(column for pair in pairs[1:] for column in pair), offset, crawls, rows.T[21]],
    }
    assert set(expected) == set(get_args(Inputs))
    for inputs, columns in expected.items():
        np.testing.assert_allclose(network_inputs(rows, inputs), np.stack(columns, axis=1), rtol=1e-6, atol=1e-6)


def test_derived_inputs_by_hand() -> None:
    row = features_of(
        speed=20,
        distance_to_lane_centre=-0.4,
        front_clearance=10,
        front_relative_speed=-5,
        left_rear_clearance=-2,
        left_rear_relative_speed=30,
    )
    seen = inputs_of(row, "derived")
    assert seen.shape == (21 + 15 + 3,)
    assert np.array_equal(seen[:21], row)
    assert seen[21:24] == pytest.approx([0.1, 0.5, 0.5])  # inverse gap, closing at 5 m/s, half a second
    assert seen[30:33] == pytest.approx([1.0, 10.0, -0.1])  # alongside and faster: everything at its limit
    assert seen[36:] == pytest.approx([0.4, np.log(21), 0.0])


def test_the_affordance_alone_stays_as_it_is() -> None:
    row = features_of(speed=2)
    assert np.array_equal(inputs_of(row, "affordance"), row)
    assert inputs_of(row, "derived")[-1] == 1.0


def test_the_motion_follows_what_is_derived() -> None:
    row = np.append(features_of(speed=20), np.float32(-0.7))
    seen = inputs_of(row, "motion")
    assert seen.shape == (21 + 15 + 3 + 1,)
    assert np.array_equal(seen[:-1], inputs_of(row[:21], "derived"))
    assert seen[-1] == np.float32(-0.7)
    for inputs in ("affordance", "derived"):
        assert np.array_equal(inputs_of(row, inputs), inputs_of(row[:21], inputs))


def test_urgency_by_hand() -> None:
    row = features_of(
        speed=20,
        distance_to_lane_centre=-0.4,
        front_clearance=10,
        front_relative_speed=-5,
        right_rear_relative_speed=3,
        right_rear_clearance=6,
    )
    seen = inputs_of(np.append(row, np.float32(-0.7)), "urgency")
    assert seen[:8] == pytest.approx([20, -0.4, 10, -5, 0, 0, 0, 3])
    assert seen[8:11] == pytest.approx([0.1, 0.5, 0.5])  # inverse gap, closing at 5 m/s, half a second
    assert seen[17:] == pytest.approx([1 / 6, 0.5, 0.4, 0.0, -0.7])


def test_urgency_says_nothing_of_sizes_and_lateral_clearances() -> None:
    row = np.random.default_rng(0).uniform(1, 9, 22).astype(np.float32)
    other = row.copy()
    hidden = [i for i, name in enumerate(FEATURES) if "length" in name or "lateral" in name]
    other[hidden] += 1
    assert len(hidden) == 9
    assert np.array_equal(inputs_of(row, "urgency"), inputs_of(other, "urgency"))
