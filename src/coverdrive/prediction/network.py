"""The network that scores every base trajectory (paper §3.1): two hidden ReLU layers and a sigmoid."""

from collections.abc import Mapping, Sequence

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

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All parameters by name, to be stored; `of` makes the same network from them."""
        layers = {f"weight_{layer}": weight for layer, weight in enumerate(self.weights)}
        layers |= {f"bias_{layer}": bias for layer, bias in enumerate(self.biases)}
        everything = {"feature_mean": self.mean, "feature_scale": self.scale, **layers}
        return {name: np.asarray(values) for name, values in everything.items()}

    @staticmethod
    def of(arrays: Mapping[str, np.ndarray]) -> "Network":
        """The network that `arrays` came from; other names are ignored."""
        layers = range(sum(name.startswith("weight_") for name in arrays))
        return Network(
            mean=arrays["feature_mean"],
            scale=arrays["feature_scale"],
            weights=tuple(arrays[f"weight_{layer}"] for layer in layers),
            biases=tuple(arrays[f"bias_{layer}"] for layer in layers),
        )
