"""The network whose last layer says where the boxes are and how large (`coverdrive.prediction.boxes.boxes`).

Along and across the road, a centre is a polynomial of time that is zero now, and the logarithm of a half size one that
is added to that of the usual size of a deviation; sizes stay within a factor of e^2.5 of the usual. The members of an
ensemble are averaged, centres and logarithms of sizes.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from numpy.polynomial.legendre import legvander

from coverdrive.prediction.learning.network import Network

_TERMS = 3
"""of the polynomials, fewer where there are fewer points"""

_BOUND = 2.5
"""of the logarithm of a half size, from the usual"""


class BoxNetwork(eqx.Module):
    """Networks from the features to P boxes, one for each point after the start."""

    network: Network
    usual: Float[Array | np.ndarray, "P 2"]
    """[m] root mean square of the training deviations from constant velocity along lon and lat"""
    trust: Float[Array | np.ndarray, " 2"]
    """share of what the network says of the logarithm of the sizes along lon and lat, as against the usual ones"""
    stretch: Float[Array | np.ndarray, " 2"]
    """factors of the sizes along lon and lat"""

    @staticmethod
    def outputs(points: int) -> int:
        """Neurons of the last layer for so many points."""
        return 4 * min(_TERMS, points)

    def decoded(self, outputs: Float[Array, "*batch O"]) -> tuple[Float[Array, "*batch P 2"], Float[Array, "*batch P 2"]]:
        """Centres [m], and logarithms of the half sizes over the usual ones, for outputs of the last layer."""
        time = np.arange(1, len(self.usual) + 1) / len(self.usual)
        shapes = legvander(2 * time - 1, min(_TERMS, len(time)) - 1)
        place, size = jnp.split(outputs.reshape(*outputs.shape[:-1], 2, -1, 2), 2, axis=-3)
        centre = jnp.einsum("tk,...ka->...ta", time[:, None] * shapes, place[..., 0, :, :]) * self.usual
        return centre, _BOUND * jnp.tanh(jnp.einsum("tk,...ka->...ta", shapes, size[..., 0, :, :]) / _BOUND)

    def members(
        self, features: Float[Array | np.ndarray, "*batch F"]
    ) -> tuple[Float[Array, "*batch E P 2"], Float[Array, "*batch E P 2"]]:
        """`decoded` for every member."""
        return self.decoded(self.network.outputs(features))

    def boxes(
        self, features: Float[Array | np.ndarray, "*batch F"]
    ) -> tuple[Float[Array, "*batch P 2"], Float[Array, "*batch P 2"]]:
        """Centres [m] and half sizes [m] at r = 1."""
        centre, size = self.members(features)
        return centre.mean(-3), self.stretch * self.usual * jnp.exp(self.trust * size.mean(-3))

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All parameters by name, to be stored; `of` makes the same from them and the kind of the network."""
        own = {f"box_{name}": np.asarray(getattr(self, name)) for name in ("usual", "trust", "stretch")}
        return own | self.network.arrays
