"""The network whose last layer says where the boxes are and how large (`coverdrive.prediction.boxes.boxes`).

Along and across the road, a centre is a polynomial of time that is zero now, and the logarithm of a half size one that
is added to that of the usual size of a deviation; sizes stay within a factor of e^2.5 of the usual. The members of an
ensemble are averaged, centres and logarithms of sizes.
"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from numpy.polynomial.legendre import legvander

from coverdrive.prediction.boxes.boxes import WHOLE, Boxes
from coverdrive.prediction.data.parts import parts
from coverdrive.prediction.learning.network import Network

_TERMS = 3
"""of the polynomials, fewer where there are fewer points"""

BOUND = 2.5
"""of the logarithm of a half size, from the usual"""


def shapes_of(points: int) -> tuple[Float[np.ndarray, "P k"], Float[np.ndarray, "P k"]]:
    """What each of k terms contributes to the centres of P boxes, and to the logarithms of their half sizes."""
    time = np.arange(1, points + 1) / points
    shapes = legvander(2 * time - 1, min(_TERMS, points) - 1)
    return time[:, None] * shapes, shapes


def decoded(
    outputs: Float[Array, "*batch O"], usual: Float[Array | np.ndarray, "P 2"]
) -> tuple[Float[Array, "*batch P 2"], Float[Array, "*batch P 2"]]:
    """Centres [m], and logarithms of the half sizes over the usual ones [m], for outputs of the last layer."""
    place, shapes = shapes_of(len(usual))
    parts = outputs.reshape(*outputs.shape[:-1], 2, -1, 2)
    centre = jnp.einsum("tk,...ka->...ta", place, parts[..., 0, :, :]) * usual
    return centre, BOUND * jnp.tanh(jnp.einsum("tk,...ka->...ta", shapes, parts[..., 1, :, :]) / BOUND)


class BoxNetwork(eqx.Module):
    """Networks from the features to P boxes, one for each point after the start."""

    network: Network
    usual: Float[Array | np.ndarray, "P 2"]
    """[m] root mean square of the training deviations from constant velocity along lon and lat"""
    arms: Float[Array | np.ndarray, "A 2"] = eqx.field(default_factory=lambda: WHOLE)
    """of the boxes (`Boxes`), the widest last"""
    early: Float[Array | np.ndarray, " 2"] = eqx.field(default_factory=lambda: np.zeros(2))
    """share of the first half sizes that the boxes of now have"""

    @staticmethod
    def outputs(points: int) -> int:
        """Neurons of the last layer for so many points."""
        return 4 * min(_TERMS, points)

    @eqx.filter_jit
    def boxes(
        self, features: Float[Array | np.ndarray, "*batch F"]
    ) -> tuple[Float[Array, "*batch P 2"], Float[Array, "*batch P 2"]]:
        """Centres [m] and half sizes [m] at r = 1."""
        centre, size = decoded(self.network.outputs(features), self.usual)
        return centre.mean(-3), jnp.exp(size.mean(-3)) * self.usual

    def boxes_of(self, features: Float[np.ndarray, "N F"]) -> Boxes:
        """The boxes for N moments, part by part: values of hidden layers take much memory."""
        found = np.empty((2, len(features), *self.usual.shape))
        for part in parts(len(features)):
            found[0, part], found[1, part] = self.boxes(features[part])
        return Boxes(found[0], found[1], np.asarray(self.arms), np.asarray(self.early))

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All parameters by name, to be stored; `of` makes the same from them and the kind of the network."""
        own = {"box_usual": self.usual, "box_arms": self.arms, "box_early": self.early}
        return {**{name: np.asarray(values) for name, values in own.items()}, **self.network.arrays}

    @staticmethod
    def of(arrays: Mapping[str, np.ndarray], kind: Mapping[str, str]) -> "BoxNetwork":
        """The network that `arrays` and the kind came from."""
        return BoxNetwork(Network.of(arrays, kind), arrays["box_usual"], arrays["box_arms"], arrays["box_early"])
