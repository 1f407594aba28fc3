"""Boxes by compiled code against those that the network gives in training."""

import jax
import numpy as np
import pytest

from coverdrive.prediction.boxes.network import BoxNetwork, _write_boxes, decoded
from coverdrive.prediction.learning.affordance import FEATURES, MOTION
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.network import Network

RNG = np.random.default_rng(0)
SOME = RNG.normal(8, 20, (50, len(FEATURES) + len(MOTION))).astype(np.float32)


@pytest.mark.parametrize(
    ("inputs", "members", "points", "hidden"), [("motion", 4, 6, (64, 64)), ("urgency", 1, 2, (5,))]
)
def test_boxes_are_those_of_the_network(inputs: Inputs, members: int, points: int, hidden: tuple[int, ...]) -> None:
    outputs = BoxNetwork.outputs(points)
    network = BoxNetwork(
        Network.create(SOME, hidden, outputs, RNG, members, inputs, "boxes"), RNG.uniform(0.1, 3, (points, 2))
    )
    outputs = network.network.outputs
    centre, size = jax.jit(lambda scaled: decoded(outputs(scaled), network.usual))(network.network.scaled(SOME))
    found = network.function(SOME)
    np.testing.assert_allclose(found[0], centre.mean(0), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found[1], np.exp(size.mean(0)) * network.usual, rtol=1e-5)
    assert network.function(SOME[:0]).shape == (2, 0, points, 2)
    unknown = SOME[:2].copy()
    unknown[1, 0] = np.nan
    now = network.function(unknown)
    assert np.isfinite(now[:, 0]).all() and np.isnan(now[:, 1]).all()


def test_a_network_that_was_read_needs_no_code_of_its_own() -> None:
    made = BoxNetwork(Network.create(SOME, (5,), 12, RNG, inputs="motion", output="boxes"), np.ones((6, 2)))
    arrays = {name: values.copy() for name, values in made.arrays.items()}
    for values in arrays.values():
        values.flags.writeable = False
    found, compiled = made.function(SOME), list(_write_boxes.signatures)
    np.testing.assert_array_equal(BoxNetwork.of(arrays, made.network.kind).function(SOME), found)
    assert list(_write_boxes.signatures) == compiled
