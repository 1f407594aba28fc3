"""The boxes of few vehicles, compiled: what `BoxNetwork.boxes` is to training, these are to a drive.

A call of XLA takes some tenths of a millisecond where milliseconds have passed since the last one, as its thread sleeps
by then and has to be woken. N vehicles, E members of the ensemble, I inputs, P boxes, k terms of the polynomials.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy.typing import ArrayLike

from coverdrive.compiled import compiled, lent
from coverdrive.prediction.boxes.network import BOUND, BoxNetwork, shapes_of
from coverdrive.prediction.learning.inputs import COLUMNS, write_inputs
from coverdrive.prediction.learning.network import LIMIT


@lent
class Forward(NamedTuple):
    """A network as compiled code takes it."""

    columns: Int[np.ndarray, " I"]
    """of all inputs, those that it sees"""
    mean: Float32[np.ndarray, " I"]
    scale: Float32[np.ndarray, " I"]
    weights: tuple[Float32[np.ndarray, "E _ _"], ...]
    """of each layer, members × inputs × outputs"""
    biases: tuple[Float32[np.ndarray, "E _"], ...]
    place: Float[np.ndarray, "P k"]
    """what the terms of the polynomials contribute to the centres"""
    shapes: Float[np.ndarray, "P k"]
    """the same of the logarithms of the half sizes"""
    usual: Float[np.ndarray, "P 2"]
    """[m]"""


def forward_of(network: BoxNetwork) -> Forward:
    """A network for `boxes_at`."""
    layers, (place, shapes) = network.network, shapes_of(len(network.usual))

    def plain(values: ArrayLike, kind: type = np.float32) -> np.ndarray:
        return np.array(values, dtype=kind, order="C")  # a copy, for which code need not be compiled anew

    return Forward(
        np.array(COLUMNS[layers.inputs]),
        plain(layers.mean),
        plain(layers.scale),
        tuple(plain(np.swapaxes(np.asarray(each), 1, 2)) for each in layers.weights),
        tuple(plain(each) for each in layers.biases),
        plain(place, float),
        plain(shapes, float),
        plain(network.usual, float),
    )


def boxes_at(features: Float32[np.ndarray, "N F"], forward: Forward) -> Float[np.ndarray, "2 N P 2"]:
    """Centres [m] (0) and half sizes [m] at r = 1 (1) of vehicles with these features."""
    seen = np.empty((len(features), len(COLUMNS["motion"])), dtype=np.float32)
    write_inputs(np.ascontiguousarray(features), seen)
    result = np.empty((2, len(features), *forward.usual.shape))
    _write_boxes(seen, forward, result)
    return result


@compiled
def _write_boxes(
    seen: Float32[np.ndarray, "N _"], forward: Forward, result: Float[np.ndarray, "2 N P 2"]
) -> None:  # fmt: skip
    """Write the boxes of vehicles whose inputs are these, all that there are."""
    members, points, terms = len(forward.biases[0]), *forward.place.shape
    sums = np.empty((2, terms, 2))
    logarithms = np.empty((points, 2))
    values = np.empty(len(forward.columns), np.float32)
    for v in range(len(seen)):
        for i in range(len(values)):
            value = (seen[v, forward.columns[i]] - forward.mean[i]) / forward.scale[i]
            values[i] = np.minimum(np.maximum(value, -LIMIT), LIMIT)
        sums[:], logarithms[:] = 0.0, 0.0
        for member in range(members):
            outputs = values
            for layer in range(len(forward.weights)):
                outputs = _after(outputs, forward.weights[layer][member], forward.biases[layer][member], layer > 0)
            for k in range(terms):
                for axis in range(2):
                    sums[0, k, axis] += outputs[2 * k + axis] / members
                    sums[1, k, axis] = outputs[2 * (terms + k) + axis]
            for p in range(points):
                for axis in range(2):
                    exponent = 0.0
                    for k in range(terms):
                        exponent += forward.shapes[p, k] * sums[1, k, axis]
                    logarithms[p, axis] += BOUND * np.tanh(exponent / BOUND) / members
        for p in range(points):
            for axis in range(2):
                centre = 0.0
                for k in range(terms):
                    centre += forward.place[p, k] * sums[0, k, axis]
                result[0, v, p, axis] = centre * forward.usual[p, axis]
                result[1, v, p, axis] = np.exp(logarithms[p, axis]) * forward.usual[p, axis]


@compiled
def _after(
    values: Float32[np.ndarray, " inputs"], weight: Float32[np.ndarray, "inputs outputs"],
    bias: Float32[np.ndarray, " outputs"], hidden: bool,
) -> Float32[np.ndarray, " outputs"]:  # fmt: skip
    """A layer of values, of which those of a ``hidden`` layer count where they are positive."""
    result = bias.copy()
    for i in range(len(values)):
        if not (hidden and values[i] <= 0):  # what is not a number stays none
            for o in range(len(result)):
                result[o] += values[i] * weight[i, o]
    return result
