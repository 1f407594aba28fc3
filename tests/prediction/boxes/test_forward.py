"""Boxes by compiled code against those that the network gives in training."""

from typing import get_args

import jax
import numpy as np
import pytest

from coverdrive.prediction.boxes.forward import boxes_at, forward_of
from coverdrive.prediction.boxes.network import BoxNetwork
from coverdrive.prediction.learning.affordance import FEATURES, MOTION
from coverdrive.prediction.learning.inputs import COLUMNS, Inputs, network_inputs, write_inputs
from coverdrive.prediction.learning.network import Network

RNG = np.random.default_rng(0)
SOME = RNG.normal(8, 20, (50, len(FEATURES) + len(MOTION))).astype(np.float32)


@pytest.mark.parametrize("inputs", get_args(Inputs))
def test_inputs_are_those_that_networks_learn_from(inputs: Inputs) -> None:
    every = np.empty((len(SOME), 40), np.float32)
    write_inputs(SOME, every)
    np.testing.assert_allclose(every[:, COLUMNS[inputs]], network_inputs(SOME, inputs), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("inputs", "members", "points", "hidden"), [("motion", 4, 6, (64, 64)), ("urgency", 1, 2, (5,))]
)
def test_boxes_are_those_of_the_network(inputs: Inputs, members: int, points: int, hidden: tuple[int, ...]) -> None:
    key, outputs = jax.random.key(1), BoxNetwork.outputs(points)
    network = BoxNetwork(
        Network.create(SOME, hidden, outputs, key, members, inputs, "boxes"), RNG.uniform(0.1, 3, (points, 2))
    )
    centre, half_sizes = network.boxes(SOME)
    found = boxes_at(SOME, forward_of(network))
    assert all(each.flags.writeable for each in forward_of(network).weights)  # of one type, freshly trained or read
    np.testing.assert_allclose(found[0], centre, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found[1], half_sizes, rtol=1e-5)
    assert boxes_at(SOME[:0], forward_of(network)).shape == (2, 0, points, 2)
    unknown = SOME[:2].copy()
    unknown[1, 0] = np.nan
    now = boxes_at(unknown, forward_of(network))
    assert np.isfinite(now[:, 0]).all() and np.isnan(now[:, 1]).all()
