"""The paper's loss, and that training learns and is reproducible."""

import jax.numpy as jnp
import numpy as np
import pytest

from coverdrive.errors import DataError
from coverdrive.prediction.network import Network
from coverdrive.prediction.samples import Samples
from coverdrive.prediction.training import TrainingSettings, margin_loss, train


def toy_samples(count: int, seed: int) -> Samples:
    """Base 1 is driven where feature 0 is positive, else base 0; base 2 always collides."""
    random = np.random.default_rng(seed)
    features = random.normal(0, 5, (count, 21)).astype(np.float32)
    features[:, 20] = 4.8  # a constant feature
    labels = np.zeros((count, 3), dtype=np.int8)
    labels[:, 2] = -1
    labels[np.arange(count), (features[:, 0] > 0).astype(int)] = 1
    return Samples(features, labels, np.zeros(count), np.arange(count), np.arange(count))


def test_loss_by_hand() -> None:
    scores = jnp.array([[0.5, 0.5, 0.5], [0.9, 0.1, 0.2]], dtype=jnp.float32)
    labels = jnp.array([[1, 0, -1], [1, 0, -1]], dtype=jnp.int8)
    first = 100 * (0.8 - 0.5) + 0.1 * (0.5 - 0.2) + 5 * (0.5 - 0.2)
    assert float(margin_loss(scores, labels, TrainingSettings())) == pytest.approx(first / 2)


def test_loss_weights_margins_apart() -> None:
    scores, labels = jnp.array([[0.7, 0.3]], dtype=jnp.float32), jnp.array([[1, -1]], dtype=jnp.int8)
    loose = TrainingSettings(margin_possible=0.6, margin_other=0.4)
    assert float(margin_loss(scores, labels, loose)) == 0


def test_network_layers_and_scaling() -> None:
    network = Network(
        np.array([1.0, 2.0]),
        np.array([2.0, 1.0]),
        (np.array([[1.0, -1.0]]), np.array([[3.0]])),
        (np.array([0.5]), np.array([-1.0])),
    )
    features = np.array([[5.0, 1.0]])  # scaled: 2, −1; hidden: relu(2 + 1 + 0.5)
    assert np.asarray(network.hidden(features)) == pytest.approx(np.array([[3.5]]))
    assert np.asarray(network.scores(features)) == pytest.approx(np.array([[1 / (1 + np.exp(-9.5))]]))


def test_training_learns_the_pattern() -> None:
    network, losses = train(toy_samples(4000, seed=0), TrainingSettings(epochs=40))
    new = toy_samples(1000, seed=1)
    scores = np.asarray(network.scores(new.features))
    driven = scores[np.arange(1000), new.base]
    assert losses[-1] < losses[0] / 5
    assert (driven > 0.5).mean() > 0.95
    assert (scores[:, 2] < 0.5).mean() > 0.99


def test_same_seed_same_network() -> None:
    few = TrainingSettings(epochs=2)
    samples = toy_samples(600, seed=0)
    networks = [train(samples, few, seed)[0] for seed in (7, 7, 8)]
    weights = [np.asarray(network.weights[0]) for network in networks]
    assert np.array_equal(weights[0], weights[1])
    assert not np.array_equal(weights[0], weights[2])


def test_no_samples_and_divergence_are_refused() -> None:
    with pytest.raises(DataError, match="no samples"):
        train(toy_samples(0, seed=0))
    broken = toy_samples(600, seed=0)
    broken.features[3, 3] = np.nan
    with pytest.raises(DataError, match="diverged"):
        train(broken, TrainingSettings(epochs=1))
