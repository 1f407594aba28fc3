"""The network that scores every base trajectory (paper §3.1): two hidden ReLU layers and a sigmoid."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, PRNGKeyArray


class Network(eqx.Module):
    """Feed-forward network from F features to M scores in [0, 1]."""

    mean: Float[Array | np.ndarray, " F"]
    """mean of the features over the training samples"""
    scale: Float[Array | np.ndarray, " F"]
    """standard deviation of the features over the training samples; 1 for constant features"""
    weights: tuple[Float[Array | np.ndarray, "_ _"], ...]
    """of each layer, outputs × inputs"""
    biases: tuple[Float[Array | np.ndarray, " _"], ...]
    """of each layer, one for each output"""

    @staticmethod
    def create(features: Float[np.ndarray, "N F"], hidden: Sequence[int], outputs: int, key: PRNGKeyArray) -> "Network":
        """A network with random weights (He et al. 2015), scaled to the training features."""
        sizes = (features.shape[1], *hidden, outputs)
        weights = [
            jax.random.normal(layer, (after, before)) * np.sqrt(2 / before)
            for layer, before, after in zip(jax.random.split(key, len(sizes) - 1), sizes[:-1], sizes[1:], strict=True)
        ]
        deviation = features.std(0)
        return Network(
            mean=features.mean(0),
            scale=np.where(deviation > 0, deviation, 1).astype(np.float32),
            weights=tuple(weights),
            biases=tuple(jnp.zeros(size) for size in sizes[1:]),
        )

    def hidden(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch H"]:
        """Values of the last hidden layer, of H neurons."""
        values = (features - self.mean) / self.scale
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = jax.nn.relu(values @ weight.T + bias)
        return jnp.asarray(values)

    def scores(self, features: Float[Array | np.ndarray, "*batch F"]) -> Float[Array, "*batch M"]:
        """Score of every base trajectory, in [0, 1]."""
        return jax.nn.sigmoid(self.hidden(features) @ self.weights[-1].T + self.biases[-1])
