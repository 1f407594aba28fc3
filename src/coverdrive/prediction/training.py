"""Training the network with the paper's margin loss (paper §3.1).

J(y, z) = Σ over bases of w₁·ReLU(γ₁ − y) where z = 1, w₀·ReLU(y − γ₂) where z = 0, w_0̄·ReLU(y − γ₂) where z = 0̄.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jaxtyping import Float, Int8, PRNGKeyArray
from pydantic import Field, PositiveFloat, PositiveInt

from coverdrive.errors import DataError
from coverdrive.prediction.network import Network
from coverdrive.prediction.samples import COLLIDES, POSSIBLE, Samples
from coverdrive.settings import Settings


class TrainingSettings(Settings):
    """The paper's network, loss and optimiser."""

    hidden: tuple[PositiveInt, ...] = (100, 50)
    """neurons of the hidden layers (authors' scripts)"""
    weight_possible: PositiveFloat = 100.0
    """w₁: of the base that was driven (authors' scripts)"""
    weight_collides: PositiveFloat = 5.0
    """w_0̄: of bases that would collide (authors' scripts)"""
    weight_other: PositiveFloat = 0.1
    """w₀: of all other bases (authors' scripts)"""
    margin_possible: float = Field(default=0.8, ge=0, le=1)
    """γ₁: scores of driven bases above it cost nothing (paper §3.1)"""
    margin_other: float = Field(default=0.2, ge=0, le=1)
    """γ₂: scores of other bases below it cost nothing (authors' scripts)"""
    learning_rate: PositiveFloat = 1e-3
    """of Adam (authors' scripts)"""
    batch: PositiveInt = 512
    """samples per step (authors' scripts)"""
    epochs: PositiveInt = 50
    """passes over the training samples (authors' scripts)"""


def margin_loss(
    scores: Float[Array, "B M"], labels: Int8[Array, "B M"], settings: TrainingSettings
) -> Float[Array, ""]:
    """The paper's loss J, averaged over the samples of a batch."""
    low = jax.nn.relu(settings.margin_possible - scores)
    high = jax.nn.relu(scores - settings.margin_other)
    weight = jnp.where(labels == COLLIDES, settings.weight_collides, settings.weight_other)
    return jnp.where(labels == POSSIBLE, settings.weight_possible * low, weight * high).sum(-1).mean()


def train(
    samples: Samples,
    settings: TrainingSettings | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> tuple[Network, Float[np.ndarray, " epochs"]]:
    """Train a network on all given samples.

    Args:
        samples: the training split Ω₁.
        settings: network, loss and optimiser.
        seed: of the initial weights and the order of the samples.
        progress: called with the share of epochs done.

    Returns:
        The network, and the mean loss of every epoch.

    Raises:
        DataError: there are no samples, or training diverged.
    """
    settings = settings or TrainingSettings()
    if len(samples) == 0:
        raise DataError("there are no samples to train on; give more recordings or a larger training share")
    start, order = jax.random.split(jax.random.key(seed))
    network = Network.create(samples.features, settings.hidden, samples.labels.shape[1], start)
    optimiser = optax.adam(settings.learning_rate)
    state = optimiser.init((network.weights, network.biases))
    features, labels = jnp.asarray(samples.features), jnp.asarray(samples.labels)
    losses: list[float] = []
    for epoch, key in enumerate(jax.random.split(order, settings.epochs)):
        network, state, loss = _epoch(network, state, optimiser, features, labels, settings, key)
        losses.append(float(loss))
        if progress is not None:
            progress((epoch + 1) / settings.epochs)
    if not np.isfinite(losses[-1]):
        raise DataError(f"training diverged (loss {losses[-1]}); use a smaller learning rate")
    return jax.tree.map(np.asarray, network), np.array(losses)


@eqx.filter_jit
def _epoch(
    network: Network,
    state: Any,
    optimiser: optax.GradientTransformation,
    features: Float[Array, "N F"],
    labels: Int8[Array, "N M"],
    settings: TrainingSettings,
    key: PRNGKeyArray,
) -> tuple[Network, Any, Float[Array, ""]]:
    size = min(settings.batch, len(features))
    batches = jax.random.permutation(key, len(features))[: len(features) // size * size].reshape(-1, size)

    def loss_of(parameters: Any, batch: Array) -> Array:
        trained = Network(network.mean, network.scale, *parameters)
        return margin_loss(trained.scores(features[batch]), labels[batch], settings)

    def step(carry: tuple[Any, Any], batch: Array) -> tuple[tuple[Any, Any], Array]:
        parameters, state = carry
        loss, gradient = jax.value_and_grad(loss_of)(parameters, batch)
        update, state = optimiser.update(gradient, state)
        return (optax.apply_updates(parameters, update), state), loss

    (parameters, state), losses = jax.lax.scan(step, ((network.weights, network.biases), state), batches)
    return Network(network.mean, network.scale, *parameters), state, losses.mean()
