"""The network whose last layer says where the boxes are and how large (`coverdrive.prediction.boxes.boxes`).

Along and across the road, a centre is a polynomial of time that is zero now, and the logarithm of a half size one that
is added to that of the usual size of a deviation; sizes stay within a factor of e^2.5 of the usual. The members of an
ensemble are averaged, centres and logarithms of sizes.

Training differentiates with JAX what its samples give; certificates and drives share one compiled function, as a call
of XLA takes some tenths of a millisecond where milliseconds have passed since the last one: its thread sleeps by then
and has to be woken. N vehicles, E members of the ensemble, I inputs, P boxes, k terms of the polynomials.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Float32
from numpy.polynomial.legendre import legvander
from numpy.typing import ArrayLike

from coverdrive.compiled import compiled, lent
from coverdrive.prediction.boxes.boxes import WHOLE, Boxes
from coverdrive.prediction.data.parts import parts
from coverdrive.prediction.learning.inputs import network_inputs
from coverdrive.prediction.learning.network import LIMIT, Network

_TERMS = 3
"""of the polynomials, fewer where there are fewer points"""

BOUND = 2.5
"""of the logarithm of a half size, from the usual"""


def shapes_of(points: int) -> tuple[Float[np.ndarray, "P k"], Float[np.ndarray, "P k"]]:
    """What each of k terms contributes to the centres of P boxes, and to the logarithms of their half sizes."""
    time = np.arange(1, points + 1) / points
    shapes = legvander(2 * time - 1, min(_TERMS, points) - 1)
    return time[:, None] * shapes, shapes


def decoded(
    outputs: Float[Array, "*batch O"], usual: Float[Array | np.ndarray, "P 2"]
) -> tuple[Float[Array, "*batch P 2"], Float[Array, "*batch P 2"]]:
    """Centres [m], and logarithms of the half sizes over the usual ones [m], for outputs of the last layer."""
    place, shapes = shapes_of(len(usual))
    parts = outputs.reshape(*outputs.shape[:-1], 2, -1, 2)
    centre = jnp.einsum("tk,...ka->...ta", place, parts[..., 0, :, :]) * usual
    return centre, BOUND * jnp.tanh(jnp.einsum("tk,...ka->...ta", shapes, parts[..., 1, :, :]) / BOUND)


class BoxNetwork(eqx.Module):
    """Networks from the features to P boxes, one for each point after the start."""

    network: Network
    usual: Float[Array | np.ndarray, "P 2"]
    """[m] root mean square of the training deviations from constant velocity along lon and lat"""
    arms: Float[Array | np.ndarray, "A 2"] = eqx.field(default_factory=lambda: WHOLE)
    """of the boxes (`Boxes`), the widest last"""
    early: Float[Array | np.ndarray, " 2"] = eqx.field(default_factory=lambda: np.zeros(2))
    """share of the first half sizes that the boxes of now have"""

    @staticmethod
    def outputs(points: int) -> int:
        """Neurons of the last layer for so many points."""
        return 4 * min(_TERMS, points)

    def boxes_of(self, features: Float[np.ndarray, "N F"]) -> Boxes:
        """The boxes of vehicles with these features, part by part: inputs on the way there take much memory."""
        found, boxes_at = np.empty((2, len(features), *self.usual.shape)), self.function
        for part in parts(len(features)):
            found[:, part] = boxes_at(features[part])
        return Boxes(found[0], found[1], np.asarray(self.arms), np.asarray(self.early))

    @property
    def function(self) -> Callable[[Float[np.ndarray, "N F"]], Float[np.ndarray, "2 N P 2"]]:
        """That of features which gives centres [m] (0) and half sizes [m] at r = 1 (1)."""
        layers, (place, shapes) = self.network, shapes_of(len(self.usual))
        inputs = layers.inputs

        def plain(values: ArrayLike, kind: type = np.float32) -> np.ndarray:
            return np.array(values, dtype=kind, order="C")  # a copy, for which code need not be compiled anew

        forward = _Forward(
            plain(layers.mean),
            plain(layers.scale),
            tuple(plain(np.swapaxes(np.asarray(each), 1, 2)) for each in layers.weights),
            tuple(plain(each) for each in layers.biases),
            plain(place, float),
            plain(shapes, float),
            plain(self.usual, float),
        )

        def boxes_at(features: Float[np.ndarray, "N F"]) -> Float[np.ndarray, "2 N P 2"]:
            result = np.empty((2, len(features), *forward.usual.shape))
            _write_boxes(network_inputs(features, inputs), forward, result)
            return result

        return boxes_at

    @property
    def kind(self) -> dict[str, str]:
        """What the networks see and give, by name."""
        return self.network.kind

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All parameters by name, to be stored; `of` makes the same from them and the kind of the network."""
        own = {"box_usual": self.usual, "box_arms": self.arms, "box_early": self.early}
        return {**{name: np.asarray(values) for name, values in own.items()}, **self.network.arrays}

    @staticmethod
    def of(arrays: Mapping[str, np.ndarray], kind: Mapping[str, str]) -> "BoxNetwork":
        """The network that `arrays` and the kind came from."""
        return BoxNetwork(Network.of(arrays, kind), arrays["box_usual"], arrays["box_arms"], arrays["box_early"])


@lent
class _Forward(NamedTuple):
    """A network as compiled code takes it."""

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


@compiled
def _write_boxes(
    seen: Float32[np.ndarray, "N I"], forward: _Forward, result: Float[np.ndarray, "2 N P 2"]
) -> None:  # fmt: skip
    """Write the boxes of vehicles whose inputs are these, all that there are."""
    members, points, terms = len(forward.biases[0]), *forward.place.shape
    sums = np.empty((2, terms, 2))
    logarithms = np.empty((points, 2))
    values = np.empty(len(forward.mean), np.float32)
    for v in range(len(seen)):
        for i in range(len(values)):
            value = (seen[v, i] - forward.mean[i]) / forward.scale[i]
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
