"""Training boxes for what they are: as small as possible on average for as many vehicles that stay inside.

With A the mean area of the boxes of a window at r = 1, and r the least scale with which they hold the whole segment, a
set of scale q has area q²·A, and q is a high quantile of r over vehicles. Training minimises log E[A] + 2·log of the
p-norm of r, which stands for that quantile: it is smooth, and changes nothing if all sizes are scaled alike.

A network knows its own training vehicles too well, so each member is trained without a part of them. How much to trust
the sizes, and how long the boxes are for their width, is chosen by the segments of vehicles that members did not see.
"""

from collections.abc import Callable
from itertools import product

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Int
from pydantic import Field

from coverdrive.prediction.boxes.boxes import body_excess
from coverdrive.prediction.boxes.network import BoxNetwork
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.training import OptimiserSettings, optimised
from coverdrive.prediction.segments import Segments

_SMOOTH = 12.0
"""power of the norm that stands for the largest of a segment's points and directions"""

_TRUSTED = np.linspace(0.5, 1.0, 6)
_STRETCHED = np.geomspace(0.3, 4.0, 25)
"""choices of the trust in sizes, and of the width of boxes for their length"""

_COVERED = 0.95
"""share of the vehicles that no member saw whose boxes are to be smallest"""


class BoxSettings(OptimiserSettings):
    """How boxes are learned."""

    inputs: Inputs = "motion"
    members: int = Field(default=8, ge=2, le=1000)
    """networks that are averaged"""
    parts: int = Field(default=4, ge=2, le=1000)
    """into which the training vehicles are dealt; each member is trained without one of them"""
    power: float = Field(default=16.0, ge=1, le=100)
    """p of the norm that stands for a quantile of the scale: the larger, the fewer segments count"""
    hidden: OptimiserSettings.__annotations__["hidden"] = (64, 64)  # pyright: ignore
    dropout: float = Field(default=0.1, ge=0, lt=1)
    learning_rate: float = Field(default=2e-3, gt=0, le=10)
    batch: int = Field(default=512, ge=1, le=1_000_000)
    epochs: int = Field(default=1000, ge=1, le=1_000_000)
    most_steps: int = Field(default=1500, ge=1, le=100_000_000)
