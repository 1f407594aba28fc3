"""The network that scores every base trajectory (paper §3.1), or an ensemble of such networks.

The paper has one network of two hidden ReLU layers and a sigmoid for each base. An ensemble of E members averages
their scores (Lakshminarayanan et al. 2017). Members with a softmax give the probability of each base; their average
may be mixed with the shares of the bases in training, so that no base is called impossible on little evidence.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, PRNGKeyArray

from coverdrive.errors import DataError
from coverdrive.prediction.data.parts import padded, parts
from coverdrive.prediction.learning.inputs import COLUMNS, Inputs, network_inputs

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
        key: PRNGKeyArray,
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
        seen_of = jax.jit(network_inputs, static_argnums=1)
        seen = np.empty((len(features), len(COLUMNS[inputs])), dtype=np.float32)
        for part in parts(len(features)):
            few = features[part]
            seen[part] = seen_of(padded(few), inputs)[: len(few)]
        sizes = (seen.shape[1], *hidden, bases)
        keys = jax.random.split(key, len(sizes) - 1)
        weights = [
            sampled(jax.random.normal, layer, (members, after, before)) * np.sqrt(2 / before)
            for layer, before, after in zip(keys, sizes[:-1], sizes[1:], strict=True)
        ]
        mean = seen.mean(0)
        seen -= mean
        deviation = np.sqrt(np.square(seen, out=seen).mean(0))  # as `std` does it, but where the inputs are
        return Network(
            mean=mean,
            scale=np.where(deviation > 0, deviation, 1).astype(np.float32),
            weights=tuple(weights),
            biases=tuple(jnp.zeros((members, size)) for size in sizes[1:]),
            prior=np.zeros(bases, dtype=np.float32),
            inputs=inputs,
            output=output,
        )

    @eqx.filter_jit
    def scaled(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch I"]:
        """What the first layer sees."""
        values = (network_inputs(features, self.inputs) - self.mean) / self.scale
        return jnp.clip(values, -LIMIT, LIMIT) if self.output == "boxes" else values

    @eqx.filter_jit
    def hidden(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch H"]:
        """Values of the last hidden layer, of H neurons; of the first member, if there are several."""
        return self._last_hidden(features)[..., 0, :]

    @eqx.filter_jit
    def scores(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch M"]:
        """Score of every base trajectory, in [0, 1]."""
        outputs = self.outputs(features)
        activate = jax.nn.softmax if self.output == "softmax" else jax.nn.sigmoid
        return (1 - self.prior.sum()) * activate(outputs).mean(-2) + self.prior

    def outputs(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch E O"]:
        """The last layer of every member."""
        return affine(self._last_hidden(features), self.weights[-1], self.biases[-1])

    def _last_hidden(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch E H"]:
        values = self.scaled(features)[..., None, :]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = jax.nn.relu(affine(values, weight, bias))
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


def sampled(draw: Callable[..., Array], key: PRNGKeyArray, shape: tuple[int, ...]) -> Array:
    """Random numbers of a shape, the same as JAX draws at once, which takes several times as long to compile."""
    return draw(key, shape=(math.prod(shape),)).reshape(shape)


def affine(
    values: Float[Array, "*batch _ inputs"],
    weight: Float[Array | np.ndarray, "E outputs inputs"],
    bias: Float[Array | np.ndarray, "E outputs"],
) -> Float[Array, "*batch E outputs"]:
    """One layer of every member; values without an axis of members are the same for all."""
    members, _, inputs = weight.shape
    values = jnp.broadcast_to(values, (*values.shape[:-2], members, inputs))
    return jnp.einsum("...ei,eoi->...eo", values, weight) + bias
