"""The losses by hand; that training learns with each, and is reproducible."""

from collections.abc import Callable

import jax
import numpy as np
import pytest

from coverdrive.errors import DataError
from coverdrive.prediction.data.parts import padded
from coverdrive.prediction.learning import training
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.samples import Samples
from coverdrive.prediction.learning.training import Loss, TrainingSettings, cross_entropy, margin_loss, optimised, train

MEMBERS = TrainingSettings(members=2, hidden=(32,), batch=100, epochs=60, most_steps=300, learning_rate=0.01)
"""settings of several tests, for which training is compiled once"""


def toy_samples(count: int, seed: int) -> Samples:
    """Base 1 is driven where feature 0 is positive, else base 0; base 2 always collides."""
    random = np.random.default_rng(seed)
    features = random.normal(0, 5, (count, 21)).astype(np.float32)
    features[:, 20] = 4.8  # a constant feature
    collides = np.tile([False, False, True], (count, 1))
    base = (features[:, 0] > 0).astype(int)
    distance = np.where(np.arange(3) == base[:, None], 0.0, 1.0)
    return Samples(features, distance, collides, base, np.arange(count), np.arange(count))


def test_margin_loss_by_hand() -> None:
    scores = np.array([[0.5, 0.5, 0.5], [0.9, 0.1, 0.2]], dtype=np.float32)
    labels = np.array([[1, 0, -1], [1, 0, -1]], dtype=np.int8)
    first = 100 * (0.8 - 0.5) + 0.1 * (0.5 - 0.2) + 5 * (0.5 - 0.2)
    assert float(jax.jit(margin_loss)(np.log(scores / (1 - scores)), labels)) == pytest.approx(first / 2)


def test_cross_entropy_is_the_surprise_at_the_driven_base() -> None:
    outputs, labels = np.log(np.array([[0.5, 0.3, 0.2]], dtype=np.float32)), np.array([[1, 0, -1]], dtype=np.int8)
    assert float(jax.jit(cross_entropy)(outputs, labels)) == pytest.approx(np.log(2))


@pytest.mark.parametrize("loss", ["margin", "cross-entropy"])
def test_training_learns_the_pattern(loss: Loss) -> None:
    few = {"loss": loss, "epochs": 40, "batch": 128, "hidden": (64,)}
    network, losses = train(toy_samples(2000, seed=0), TrainingSettings.paper().model_copy(update=few))
    new = toy_samples(1000, seed=1)
    scores = network.scores(new.features)
    driven = scores[np.arange(1000), new.base]
    assert losses[-1] < losses[0] / 3
    assert (driven > 0.5).mean() > 0.95
    assert (scores[:, 2] < 0.5).mean() > 0.99


@pytest.fixture(scope="module")
def ensemble() -> tuple[Network, np.ndarray]:
    """Of two members, and its losses."""
    return train(toy_samples(1000, seed=0), MEMBERS, seed=7)


def test_an_ensemble_learns_and_keeps_the_prior(ensemble: tuple[Network, np.ndarray]) -> None:
    network, samples, new = ensemble[0], toy_samples(1000, seed=0), toy_samples(1000, seed=1)
    scores = network.scores(new.features)
    assert scores.sum(1) == pytest.approx(np.ones(1000), abs=1e-5)
    assert (scores.argmax(1) == new.base).mean() > 0.95
    shares = np.bincount(samples.base, minlength=3) / 1000
    assert np.asarray(network.prior) == pytest.approx(0.3 * shares)
    assert (scores >= np.asarray(network.prior) - 1e-6).all()


def test_same_seed_same_network_of_members_that_differ(ensemble: tuple[Network, np.ndarray]) -> None:
    first = np.asarray(ensemble[0].weights[0])
    assert first.shape[0] == 2 and not np.allclose(first[0], first[1])
    again, other = (np.asarray(train(toy_samples(1000, seed=0), MEMBERS, seed)[0].weights[0]) for seed in (7, 8))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_what_is_compiled_serves_other_numbers_of_samples() -> None:
    traced, short = list[int](), MEMBERS.model_copy(update={"most_steps": 30})

    def loss(outputs: jax.Array, labels: jax.Array) -> jax.Array:
        traced.append(len(outputs))
        return cross_entropy(outputs, labels)

    def compiled(count: int) -> bool:
        before, samples, random = len(traced), toy_samples(count, seed=0), np.random.default_rng(0)
        network = Network.create(samples.features, short.hidden, 3, random, short.members, output="softmax")
        optimised(network, network.scaled(samples.features), samples.labels, loss, short, random)
        return len(traced) > before

    assert compiled(600)
    assert not compiled(900)
    assert compiled(1100)


def test_what_follows_the_samples_is_not_seen(
    ensemble: tuple[Network, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    def unusable(values: np.ndarray) -> np.ndarray:
        rows = padded(values)
        if rows.dtype.kind == "f":
            rows[len(values) :] = np.nan
        return rows

    monkeypatch.setattr(training, "padded", unusable)
    network, losses = train(toy_samples(1000, seed=0), MEMBERS, seed=7)
    assert np.array_equal(losses, ensemble[1])
    assert np.array_equal(network.weights[0], ensemble[0].weights[0])


def test_no_samples_and_divergence_are_refused() -> None:
    with pytest.raises(DataError, match="no samples"):
        train(toy_samples(0, seed=0))
    broken = toy_samples(1000, seed=0)
    broken.features[3, 3] = np.nan
    with pytest.raises(DataError, match="diverged"):
        train(broken, MEMBERS)


def test_many_samples_are_trained_on_in_fewer_passes(ensemble: tuple[Network, np.ndarray]) -> None:
    settings = TrainingSettings(batch=100, epochs=10, most_steps=50)
    assert [settings.passes(count) for count in (30, 500, 1000, 2000, 100_000)] == [10, 10, 5, 3, 1]
    assert len(ensemble[1]) == MEMBERS.passes(1000) == 30


@pytest.mark.parametrize("draw", [jax.random.normal, jax.random.bernoulli])
def test_random_numbers_are_those_that_jax_draws_of_the_shape(draw: Callable[..., jax.Array]) -> None:
    key = jax.random.key(3)
    np.testing.assert_array_equal(training._sampled(draw, key, (2, 3, 5)), draw(key, shape=(2, 3, 5)))
