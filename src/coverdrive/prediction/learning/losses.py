"""What training minimises: the paper's margin loss and two losses of the field, averaged over a batch of B samples."""

from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
import optax
from jax import Array
from jaxtyping import Float, Int8
from pydantic import Field

from coverdrive.prediction.learning.network import Output
from coverdrive.prediction.learning.samples import COLLIDES, POSSIBLE
from coverdrive.settings import Settings

Loss = Literal["cross-entropy", "margin", "weighted-bce"]

OUTPUT: dict[Loss, Output] = {"cross-entropy": "softmax", "margin": "sigmoid", "weighted-bce": "sigmoid"}
"""What makes scores of the last layer that was trained with a loss"""


class MarginSettings(Settings):
    """The paper's margin loss."""

    weight_possible: float = Field(default=100.0, gt=0, le=1e6)
    """w₁: of the base that was driven (authors' scripts)"""
    weight_collides: float = Field(default=5.0, gt=0, le=1e6)
    """w_0̄: of bases that would collide (authors' scripts)"""
    weight_other: float = Field(default=0.1, gt=0, le=1e6)
    """w₀: of all other bases (authors' scripts)"""
    margin_possible: float = Field(default=0.8, ge=0, le=1)
    """γ₁: scores of driven bases above it cost nothing (paper §3.1)"""
    margin_other: float = Field(default=0.2, ge=0, le=1)
    """γ₂: scores of other bases below it cost nothing (authors' scripts)"""


POSITIVE_WEIGHT = 10.0
"""of the driven base in the weighted binary cross-entropy"""


def margin_loss(scores: Float[Array, "B M"], labels: Int8[Array, "B M"], settings: MarginSettings) -> Float[Array, ""]:
    """The paper's loss J (§3.1), of scores after the sigmoid.

    J(y, z) = Σ over bases of w₁·ReLU(γ₁ − y) where z = 1, w₀·ReLU(y − γ₂) where z = 0, w_0̄·ReLU(y − γ₂) where z = 0̄.
    """
    low = jax.nn.relu(settings.margin_possible - scores)
    high = jax.nn.relu(scores - settings.margin_other)
    weight = jnp.where(labels == COLLIDES, settings.weight_collides, settings.weight_other)
    return jnp.where(labels == POSSIBLE, settings.weight_possible * low, weight * high).sum(-1).mean()


def loss_function(loss: Loss, margin: MarginSettings) -> Callable[[Array, Array], Float[Array, ""]]:
    """The loss of a name, of the last layer's outputs (B, M) and labels (B, M)."""

    def cross_entropy(outputs: Float[Array, "B M"], labels: Int8[Array, "B M"]) -> Float[Array, ""]:
        driven = (labels == POSSIBLE).argmax(-1)
        return optax.softmax_cross_entropy_with_integer_labels(outputs, driven).mean()

    def weighted_bce(outputs: Float[Array, "B M"], labels: Int8[Array, "B M"]) -> Float[Array, ""]:
        driven = jnp.where(labels == POSSIBLE, 1.0, 0.0)
        weight = jnp.where(labels == POSSIBLE, POSITIVE_WEIGHT, 1.0)
        return (weight * optax.sigmoid_binary_cross_entropy(outputs, driven)).sum(-1).mean()

    def margins(outputs: Float[Array, "B M"], labels: Int8[Array, "B M"]) -> Float[Array, ""]:
        return margin_loss(jax.nn.sigmoid(outputs), labels, margin)

    return {"cross-entropy": cross_entropy, "weighted-bce": weighted_bce, "margin": margins}[loss]
