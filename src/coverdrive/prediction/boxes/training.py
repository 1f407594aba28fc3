"""Training boxes for what they are for: to be as small as possible on average while enough vehicles stay inside.

With A the mean area of the boxes of a segment at r = 1, and r the least scale with which they hold all of it, the sets
of scale q have area q²·A, and q is a high quantile of r. Training minimises log E[A] + 2·log of the p-norm of r, which
stands for that quantile: it is smooth, and changes nothing if all sizes are scaled alike.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial
from jaxtyping import Float, Float32
from pydantic import Field

from coverdrive.certificates.certificate import Unit
from coverdrive.prediction.boxes.boxes import WHOLE, body_excess
from coverdrive.prediction.boxes.network import BoxNetwork, decoded
from coverdrive.prediction.data.parts import aligned, parts
from coverdrive.prediction.data.segments import Segments
from coverdrive.prediction.learning.affordance import mirrored_features
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.training import Hidden, OptimiserSettings, optimised

_SMOOTH = 12.0
"""power of the norm that stands for the largest over a segment's points and directions"""

_CALM = 0.1
"""factor of the first weights of the last layer, so that training begins near the usual sizes"""

_POWER_OF_WINDOWS = 3.0
"""p of the norm where windows, or the share of a vehicle's windows, are counted: more of them may be missed"""

_KEPT = 0.7
"""of differences in size that few vehicles taught: the worst windows of others show less of them"""

_CROSS = np.array([[1.0, 0.6], [0.7, 1.0]])
"""arms where every window of a vehicle has to stay inside: who changes lanes unforeseen neither brakes nor accelerates
hardest at that"""

_MIRROR = np.array([1, -1, 1, 1], dtype=np.float32)
"""what the mirror image, left for right, makes of what boxes are to hold"""

_CLOSEST = 1e-6
"""[of the half sizes] distances below it count as this much"""


class BoxSettings(OptimiserSettings):
    """How boxes are learned; the rest is as for scores."""

    inputs: Inputs = "motion"
    """what the network sees of the affordance"""
    few: int = Field(default=500, ge=0, le=1_000_000)
    """of fewer training vehicles than this, the network sees "urgency" instead, as it would learn them by heart"""
    power: float = Field(default=12.0, ge=1, le=100)
    """p of the norm that stands for a quantile of the scale, where every window of a vehicle has to stay inside; the
    larger, the fewer segments decide"""
    hidden: Hidden = (64, 64)
    """neurons of the hidden layers"""
    noise: float = Field(default=0.3, ge=0, le=100)
    """standard deviation of noise on the scaled inputs"""
    weight_decay: float = Field(default=0.1, ge=0, le=1e3)
    """of AdamW"""
    learning_rate: float = Field(default=2e-3, gt=0, le=10)
    """of the first step"""
    batch: int = Field(default=512, ge=1, le=1_000_000)
    """samples per step"""
    epochs: int = Field(default=1000, ge=1, le=1_000_000)
    """passes over the training samples, unless there are so many that ``most_steps`` ends training before"""
    most_steps: int = Field(default=1500, ge=1, le=100_000_000)
    """training on many samples ends after so many steps, be it in fewer passes"""


def train_boxes(
    features: Float[np.ndarray, "N F"],
    segments: Segments,
    settings: BoxSettings,
    seed: int = 0,
    unit: Unit = "vehicle",
    early: Float[np.ndarray, " 2"] | None = None,
) -> tuple[BoxNetwork, Float[np.ndarray, " epochs"]]:
    """A network trained on the features at the start of segments, and the mean loss of every epoch.

    If the settings say so, it is trained on their mirror images as well. The unit is what the claim will count, and
    ``early`` as of `early_share`. The seed is of the initial weights, the order of the samples, dropout and noise;
    `DataError` as of `optimised`.
    """
    windows = unit in ("window", "share")
    power = _POWER_OF_WINDOWS if windows else settings.power
    usual = np.sqrt((segments.points[:, 1:] ** 2).mean(0)).astype(np.float32)
    few = len(np.unique(segments.vehicle)) < settings.few
    targets = _targets(segments, settings.mirrored)
    del segments  # where the caller does not keep them, either, they take no memory during training
    if settings.mirrored:
        features = np.concatenate([features, mirrored_features(features)])
    inputs = "urgency" if few else settings.inputs
    sizes = settings.hidden, BoxNetwork.outputs(len(usual))
    random = np.random.default_rng(seed)
    network = Network.create(features, *sizes, random, settings.members, inputs, "boxes")
    network = eqx.tree_at(lambda made: made.weights[-1], network, _CALM * network.weights[-1])
    usual = np.maximum(usual, _CLOSEST)
    loss = Partial(box_loss, usual=usual, power=power)
    scaled = network.scaled(features)
    del features
    trained, losses = optimised(network, scaled, targets, loss, settings, random)
    evened = _evened(trained, scaled) if few and not windows else trained
    arms = WHOLE if windows else _CROSS
    return BoxNetwork(evened, usual, arms, np.zeros(2) if early is None else early), losses


def _targets(segments: Segments, mirrored: bool) -> Float32[np.ndarray, "R P 4"]:
    """What boxes are to hold (`box_loss`), part by part: on the way there it takes much memory.

    If asked for, what they hold of the mirror images follows.
    """
    targets = aligned((1 + mirrored) * len(segments), segments.points.shape[1] - 1, 4)
    for part in parts(len(segments)):
        targets[part, :, :2] = segments.points[part, 1:]
        targets[part, :, 2:] = body_excess(segments.of(part))
    if mirrored:
        np.multiply(targets[: len(segments)], _MIRROR, out=targets[len(segments) :])
    return targets


def _evened(network: Network, scaled: Float[np.ndarray, "N I"]) -> Network:
    """With sizes, the second half of what the last layer gives, that differ less from their mean on the samples."""
    mean = np.asarray(network.outputs(scaled)).mean(1)
    kept = np.where(np.arange(mean.shape[-1]) < mean.shape[-1] // 2, 1, _KEPT).astype(np.float32)
    last = kept[:, None] * network.weights[-1], kept * network.biases[-1] + (1 - kept) * mean
    return eqx.tree_at(lambda made: (made.weights[-1], made.biases[-1]), network, last)


def box_loss(
    last: Float[Array, "B O"], wanted: Float[Array, "B P 4"], usual: Float[Array | np.ndarray, "P 2"], power: float
) -> Float[Array, ""]:
    """What training minimises, of outputs of the last layer and what the boxes that they make are to hold.

    That is the deviation of the body's centre, followed by how much farther it reaches because it is turned [m].
    """
    centre, size = decoded(last, usual)
    half_sizes = usual * jnp.exp(size)
    beyond = (jnp.abs(wanted[..., :2] - centre) + wanted[..., 2:]) / half_sizes
    scale = jax.nn.logsumexp(_SMOOTH * jnp.log(jnp.maximum(beyond, 0) + _CLOSEST), axis=(1, 2)) / _SMOOTH
    norm = (jax.nn.logsumexp(power * scale) - jnp.log(len(scale))) / power
    return jnp.log(half_sizes.prod(-1).mean()) + 2 * norm
