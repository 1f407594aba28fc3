"""The network that scores every base trajectory (paper §3.1), or an ensemble of such networks.

The paper has one network of two hidden ReLU layers and a sigmoid for each base. An ensemble of E members averages
their scores (Lakshminarayanan et al. 2017). Members with a softmax give the probability of each base; their average
may be mixed with the shares of the bases in training, so that no base is called impossible on little evidence.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Float32

from coverdrive.errors import DataError
from coverdrive.prediction.learning.inputs import Inputs, network_inputs

Output = Literal["sigmoid", "softmax", "boxes"]

LIMIT = 3.0
"""of scaled inputs to networks that give boxes, which have to make sense of what no training sample was like"""


class Network(eqx.Module):
    """E feed-forward networks from the features to M scores in [0, 1]."""

    mean: Float[Array | np.ndarray, " I"]
    """mean of the inputs over the training samples"""
    scale: Float[Array | np.ndarray, " I"]
    """standard deviation of the inputs over the training samples; 1 for constant inputs"""
    weights: tuple[Float[Array | np.ndarray, "E _ _"], ...]
    """of each layer, members × outputs × inputs"""
    biases: tuple[Float[Array | np.ndarray, "E _"], ...]
    """of each layer, members × outputs"""
    prior: Float[Array | np.ndarray, " M"]
    """what every score has at least; the scores of the members have the weight that its sum leaves"""
    inputs: Inputs = eqx.field(static=True)
    """what the network sees of the features"""
    output: Output = eqx.field(static=True)
    """what the last layer is turned into: scores, or boxes (`coverdrive.prediction.boxes`)"""

    @staticmethod
    def create(
        features: Float[np.ndarray, "N F"],
        hidden: Sequence[int],
        bases: int,
        random: np.random.Generator,
        members: int = 1,
        inputs: Inputs = "affordance",
        output: Output = "sigmoid",
    ) -> "Network":
        """Random weights (He et al. 2015) from the features of the training samples to M = ``bases`` scores, no prior.

        ``hidden`` are the neurons of the hidden layers, ``members`` is the number E of networks; without features, a
        `DataError`.
        """
        if len(features) == 0:
            raise DataError("there are no samples to train on; give more recordings or a larger training share")
        seen = network_inputs(features, inputs)
        sizes = (seen.shape[1], *hidden, bases)
        weights = [
            random.normal(0, np.sqrt(2 / before), (members, after, before)).astype(np.float32)
            for before, after in pairwise(sizes)
        ]
        mean = seen.mean(0)
        seen -= mean
        deviation = np.sqrt(np.square(seen, out=seen).mean(0))  # as `std` does it, but where the inputs are
        return Network(
            mean=mean,
            scale=np.where(deviation > 0, deviation, 1).astype(np.float32),
            weights=tuple(weights),
            biases=tuple(np.zeros((members, size), dtype=np.float32) for size in sizes[1:]),
            prior=np.zeros(bases, dtype=np.float32),
            inputs=inputs,
            output=output,
        )

    def scaled(self, features: Float[np.ndarray, "N F"]) -> Float32[np.ndarray, "N I"]:
        """What the first layer sees."""
        values = network_inputs(features, self.inputs)
        values -= self.mean
        values /= self.scale
        return values.clip(-LIMIT, LIMIT, out=values) if self.output == "boxes" else values

    def scores(self, features: Float[np.ndarray, "N F"]) -> Float32[np.ndarray, "N M"]:
        """Score of every base trajectory, in [0, 1]."""
        return self.scores_and_hidden(features)[0]

    def scores_and_hidden(
        self, features: Float[np.ndarray, "N F"]
    ) -> tuple[Float32[np.ndarray, "N M"], Float32[np.ndarray, "N H"]]:
        """The scores, and the values of the last hidden layer, of H neurons; of the first member of several."""
        scores, hidden = _scored(self, self.scaled(features))
        return np.asarray(scores), np.asarray(hidden)

    def scored(self, scaled: Float[Array | np.ndarray, "N I"]) -> tuple[Float[Array, "N M"], Float[Array, "N H"]]:
        """The same of what the first layer sees."""
        hidden = self._last_hidden(scaled)
        activate = jax.nn.softmax if self.output == "softmax" else jax.nn.sigmoid
        scores = activate(_affine(hidden, self.weights[-1], self.biases[-1])).mean(0)
        return (1 - self.prior.sum()) * scores + self.prior, hidden[0]

    def outputs(self, scaled: Float[Array | np.ndarray, "N I"]) -> Float[Array, "E N O"]:
        """The last layer of every member, of what the first one sees."""
        return _affine(self._last_hidden(scaled), self.weights[-1], self.biases[-1])

    def _last_hidden(self, scaled: Float[Array | np.ndarray, "N I"]) -> Float[Array, "E N H"]:
        values = jnp.asarray(scaled)[None]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = jax.nn.relu(_affine(values, weight, bias))
        return values

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All parameters by name, to be stored; `of` makes the same network from them and `kind`."""
        layers = {f"weight_{layer}": weight for layer, weight in enumerate(self.weights)}
        layers |= {f"bias_{layer}": bias for layer, bias in enumerate(self.biases)}
        everything = {"feature_mean": self.mean, "feature_scale": self.scale, "prior": self.prior, **layers}
        return {name: np.asarray(values) for name, values in everything.items()}

    @property
    def kind(self) -> dict[str, str]:
        """What the network sees and gives, by name."""
        return {"inputs": self.inputs, "output": self.output}

    @staticmethod
    def of(arrays: Mapping[str, np.ndarray], kind: Mapping[str, str]) -> "Network":
        """The network that `arrays` and `kind` came from, ignoring other arrays."""
        layers = range(sum(name.startswith("weight_") for name in arrays))
        return Network(
            mean=arrays["feature_mean"],
            scale=arrays["feature_scale"],
            weights=tuple(arrays[f"weight_{layer}"] for layer in layers),
            biases=tuple(arrays[f"bias_{layer}"] for layer in layers),
            prior=arrays["prior"],
            **kind,  # pyright: ignore[reportArgumentType]
        )


_scored = eqx.filter_jit(Network.scored)


def _affine(
    values: Float[Array, "_ N inputs"],
    weight: Float[Array | np.ndarray, "E outputs inputs"],
    bias: Float[Array | np.ndarray, "E outputs"],
) -> Float[Array, "E N outputs"]:
    """One layer of every member, of values that each has, or all have."""
    return values @ jnp.swapaxes(weight, 1, 2) + jnp.asarray(bias)[:, None]
