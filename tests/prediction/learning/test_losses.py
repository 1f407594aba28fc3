"""The losses, by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from coverdrive.prediction.learning.losses import MarginSettings, loss_function, margin_loss

LABELS = jnp.array([[1, 0, -1]], dtype=jnp.int8)


def test_loss_by_hand() -> None:
    scores = jnp.array([[0.5, 0.5, 0.5], [0.9, 0.1, 0.2]], dtype=jnp.float32)
    labels = jnp.array([[1, 0, -1], [1, 0, -1]], dtype=jnp.int8)
    first = 100 * (0.8 - 0.5) + 0.1 * (0.5 - 0.2) + 5 * (0.5 - 0.2)
    assert float(margin_loss(scores, labels, MarginSettings())) == pytest.approx(first / 2)


def test_loss_weights_margins_apart() -> None:
    scores, labels = jnp.array([[0.7, 0.3]], dtype=jnp.float32), jnp.array([[1, -1]], dtype=jnp.int8)
    loose = MarginSettings(margin_possible=0.6, margin_other=0.4)
    assert float(margin_loss(scores, labels, loose)) == 0


def test_cross_entropy_is_the_surprise_at_the_driven_base() -> None:
    outputs = jnp.log(jnp.array([[0.5, 0.3, 0.2]]))
    assert float(loss_function("cross-entropy", MarginSettings())(outputs, LABELS)) == pytest.approx(np.log(2))


def test_weighted_bce_counts_the_driven_base_tenfold() -> None:
    loss = loss_function("weighted-bce", MarginSettings())(jnp.zeros((1, 3)), LABELS)
    assert float(loss) == pytest.approx((10 + 1 + 1) * np.log(2))


def test_margin_loss_takes_the_sigmoid_of_the_outputs() -> None:
    loss = loss_function("margin", MarginSettings())(jnp.zeros((1, 3)), LABELS)
    assert float(loss) == pytest.approx(100 * 0.3 + 0.1 * 0.3 + 5 * 0.3)
