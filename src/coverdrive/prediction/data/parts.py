"""Many rows are worked on part by part where values on the way would take much memory.

Few get rows of zeros after them, so that what JAX compiles serves for other numbers, too.
"""

import numpy as np
from jax import Array
from jaxtyping import Shaped

PART = 2**16
"""rows of a part"""


def parts(rows: int) -> list[slice]:
    """The parts of so many rows, in their order."""
    return [slice(first, min(first + PART, rows)) for first in range(0, rows, PART)]


def padded(values: Shaped[Array | np.ndarray, "N *rest"]) -> Shaped[Array | np.ndarray, "R *rest"]:
    """Followed by zeros up to a power of two, unless they are more than a part."""
    room = (1 << (len(values) - 1).bit_length()) - len(values)
    return np.pad(values, [(0, room)] + [(0, 0)] * (values.ndim - 1)) if len(values) <= PART else values
