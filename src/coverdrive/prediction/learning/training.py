"""Training the network, or every member of an ensemble (paper §3.1).

Of scores, either the paper's margin loss is minimised, or cross-entropy; averaged over a batch of B samples.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jaxtyping import Float, Int, Int8, PRNGKeyArray, Shaped
from pydantic import Field

from coverdrive.errors import DataError
from coverdrive.prediction.data.parts import padded
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.samples import COLLIDES, POSSIBLE, Samples
from coverdrive.progress import done
from coverdrive.settings import Settings

Loss = Literal["cross-entropy", "margin"]

WEIGHT_POSSIBLE, WEIGHT_COLLIDES, WEIGHT_OTHER = 100.0, 5.0, 0.1
"""w₁, w_0̄, w₀ of the margin loss: of the base that was driven, of those that would collide, of all others (authors'
scripts)"""

MARGIN_POSSIBLE, MARGIN_OTHER = 0.8, 0.2
"""γ₁, γ₂: scores of driven bases above the one (paper §3.1), and of others below the other one (authors' scripts), cost
nothing"""

Hidden = Annotated[tuple[Annotated[int, Field(ge=1, le=10_000)], ...], Field(max_length=20)]
"""Neurons of hidden layers"""


class OptimiserSettings(Settings):
    """Networks and how their loss is minimised."""

    inputs: Inputs = "derived"
    """what the network sees of the affordance"""
    mirrored: bool = True
    """with every sample, its mirror image (left for right) is trained on"""
    members: int = Field(default=4, ge=1, le=1000)
    """networks whose scores are averaged"""
    hidden: Hidden = (100, 50)
    """neurons of the hidden layers (authors' scripts)"""
    dropout: float = Field(default=0.2, ge=0, lt=1)
    """share of the hidden neurons that are left out in each step"""
    noise: float = Field(default=0.1, ge=0, le=100)
    """standard deviation of noise on the scaled inputs"""
    weight_decay: float = Field(default=1e-2, ge=0, le=1e3)
    """of AdamW (Loshchilov & Hutter 2019); with 0 it is Adam"""
    learning_rate: float = Field(default=1e-3, gt=0, le=10)
    """of the first step"""
    annealed: bool = True
    """the learning rate falls to zero along a cosine"""
    batch: int = Field(default=256, ge=1, le=1_000_000)
    """samples per step"""
    epochs: int = Field(default=50, ge=1, le=1_000_000)
    """passes over the training samples (authors' scripts)"""
    most_steps: int = Field(default=2500, ge=1, le=100_000_000)
    """training on many samples ends after so many steps, be it in fewer passes"""

    def passes(self, samples: int) -> int:
        """Passes over so many samples."""
        return min(self.epochs, math.ceil(self.most_steps / self.steps(samples)))

    def steps(self, samples: int) -> int:
        """Steps of a pass; samples that do not fill a batch wait for another one."""
        return max(1, samples // self.batch)


class TrainingSettings(OptimiserSettings):
    """Of scores of base trajectories; the defaults are what gave the smallest sets, `paper` what the paper has."""

    loss: Loss = "cross-entropy"
    """what is minimised"""
    prior: float = Field(default=0.3, ge=0, lt=1)
    """share of every score that comes from how often each base was driven in training"""

    @staticmethod
    def paper() -> "TrainingSettings":
        """One network on the 21 features, margin loss, Adam (paper §3.1, authors' scripts)."""
        return TrainingSettings(
            loss="margin",
            inputs="affordance",
            mirrored=False,
            members=1,
            prior=0.0,
            dropout=0.0,
            noise=0.0,
            weight_decay=0.0,
            annealed=False,
            batch=512,
            most_steps=1_000_000,
        )


def train(
    samples: Samples, settings: TrainingSettings | None = None, seed: int = 0
) -> tuple[Network, Float[np.ndarray, " epochs"]]:
    """A network trained on all given samples, and the mean loss of every epoch; `DataError` where training diverges.

    The seed is of the initial weights, the order of the samples, dropout and noise.
    """
    settings = settings or TrainingSettings()
    random, labels = np.random.default_rng(seed), samples.labels
    sizes, margin = (settings.hidden, labels.shape[1]), settings.loss == "margin"
    output = "sigmoid" if margin else "softmax"
    network = Network.create(samples.features, *sizes, random, settings.members, settings.inputs, output)
    lost = margin_loss if margin else cross_entropy
    network, losses = optimised(network, network.scaled(samples.features), labels, lost, settings, random)
    shares = np.bincount(samples.base, minlength=labels.shape[1]) / len(samples)
    prior = (settings.prior * shares).astype(np.float32)
    return eqx.tree_at(lambda made: made.prior, network, prior), losses


def margin_loss(outputs: Float[Array, "B M"], labels: Int8[Array, "B M"]) -> Float[Array, ""]:
    """The paper's loss J (§3.1), of the last layer's outputs, which a sigmoid makes the scores y.

    J(y, z) = Σ over bases of w₁·ReLU(γ₁ − y) where z = 1, w₀·ReLU(y − γ₂) where z = 0, w_0̄·ReLU(y − γ₂) where z = 0̄.
    """
    scores = jax.nn.sigmoid(outputs)
    low, high = jax.nn.relu(MARGIN_POSSIBLE - scores), jax.nn.relu(scores - MARGIN_OTHER)
    weight = jnp.where(labels == COLLIDES, WEIGHT_COLLIDES, WEIGHT_OTHER)
    return jnp.where(labels == POSSIBLE, WEIGHT_POSSIBLE * low, weight * high).sum(-1).mean()


def cross_entropy(outputs: Float[Array, "B M"], labels: Int8[Array, "B M"]) -> Float[Array, ""]:
    """The surprise at the driven base, of outputs of which a softmax makes scores."""
    driven = (labels == POSSIBLE).argmax(-1)
    return optax.softmax_cross_entropy_with_integer_labels(outputs, driven).mean()


def optimised(
    network: Network,
    scaled: Float[np.ndarray, "N I"],
    targets: Shaped[Array | np.ndarray, "N *target"],
    loss: Callable[[Array, Array], Array],
    settings: OptimiserSettings,
    random: np.random.Generator,
) -> tuple[Network, Float[np.ndarray, " epochs"]]:
    """The network with the least loss of its last layer (B, O) and the targets of a batch; the loss of every epoch.

    ``scaled`` is what its first layer sees; `DataError` where training diverges.
    """
    samples, passes, steps = len(scaled), settings.passes(len(scaled)), settings.steps(len(scaled))
    seen, wanted = jax.device_put(padded(scaled)), jax.device_put(padded(targets))  # without a copy
    size = min(settings.batch, samples)
    most = len(seen) // size
    rates = np.zeros((passes, most), dtype=np.float32)
    rates[:, :steps] = _rates(settings, passes * steps).reshape(passes, steps)
    parameters = (network.weights, network.biases)
    state = jax.jit(_optimiser(settings, settings.learning_rate).init)(parameters)
    keys, losses = jax.random.split(jax.random.key(random.integers(2**63)), passes), list[float]()
    batches = np.zeros((most, settings.members, size), dtype=np.int32)
    for epoch in range(passes):  # not over the keys, which compiles a part for each of them
        for member in range(settings.members):
            batches[:steps, member] = random.permutation(samples)[: steps * size].reshape(steps, size)
        drawn_from = seen, wanted, jnp.asarray(batches), jnp.asarray(rates[epoch]), jnp.asarray(steps)
        parameters, state, total = _epoch(parameters, state, *drawn_from, loss, settings, keys[epoch])
        losses.append(float(total) / steps)
        done(epoch + 1, passes)
    if not np.isfinite(losses[-1]):
        raise DataError(f"training diverged (loss {losses[-1]}); use a smaller learning rate")
    trained = eqx.tree_at(lambda made: (made.weights, made.biases), network, parameters)
    return jax.tree.map(np.asarray, trained), np.array(losses)


def _rates(settings: OptimiserSettings, steps: int) -> Float[np.ndarray, " steps"]:
    """The learning rate of every step."""
    if not settings.annealed:
        return np.full(steps, settings.learning_rate, dtype=np.float32)
    return np.asarray(jax.jit(optax.cosine_decay_schedule(settings.learning_rate, steps))(jnp.arange(steps)))


def _optimiser(settings: OptimiserSettings, rate: float | Array) -> optax.GradientTransformation:
    return optax.adamw(rate, weight_decay=settings.weight_decay)


@eqx.filter_jit
def _epoch(
    parameters: Any,
    state: Any,
    seen: Float[Array, "R I"],
    targets: Shaped[Array, "R *target"],
    batches: Int[Array, "S E B"],
    rates: Float[Array, " S"],
    steps: Int[Array, ""],
    loss: Callable[[Array, Array], Array],
    settings: OptimiserSettings,
    key: PRNGKeyArray,
) -> tuple[Any, Any, Float[Array, ""]]:
    """One pass over the samples, of which each member sees those of its own batches, and the sum of the losses.

    It takes so many ``steps``, with the first batches and rates: what is compiled serves for other numbers of samples.
    """
    keys = jax.random.split(key, (len(rates), settings.members))

    def loss_of_member(parameters: Any, batch: Array, key: PRNGKeyArray) -> Array:
        return loss(_outputs(parameters, seen[batch], settings, key), targets[batch])

    def loss_of(parameters: Any, batch: Array, keys: PRNGKeyArray) -> Array:
        return jax.vmap(loss_of_member)(parameters, batch, keys).sum()

    def step(i: Array, carry: tuple[Any, Any, Array]) -> tuple[Any, Any, Array]:
        parameters, state, total = carry
        loss, gradient = jax.value_and_grad(loss_of)(parameters, batches[i], keys[i])
        update, state = _optimiser(settings, rates[i]).update(gradient, state, parameters)
        return optax.apply_updates(parameters, update), state, total + loss / settings.members

    return jax.lax.fori_loop(0, steps, step, (parameters, state, jnp.zeros(())))


def _outputs(
    parameters: Any, inputs: Float[Array, "B I"], settings: OptimiserSettings, key: PRNGKeyArray
) -> Float[Array, "B M"]:
    """What the last layer of a member gives in training: with noise on the inputs and with neurons left out."""
    weights, biases = parameters
    keys = jax.random.split(key, len(weights))
    values = inputs + settings.noise * _sampled(jax.random.normal, keys[-1], inputs.shape) if settings.noise else inputs
    keeps = partial(jax.random.bernoulli, p=1 - settings.dropout)
    for weight, bias, dropped in zip(weights[:-1], biases[:-1], keys[:-1], strict=True):
        values = jax.nn.relu(values @ weight.T + bias)
        if settings.dropout:
            values = values * _sampled(keeps, dropped, values.shape) / (1 - settings.dropout)
    return values @ weights[-1].T + biases[-1]


def _sampled(draw: Callable[..., Array], key: PRNGKeyArray, shape: tuple[int, ...]) -> Array:
    """Random numbers of a shape, the same as JAX draws at once, which takes several times as long to compile."""
    return draw(key, shape=(math.prod(shape),)).reshape(shape)
