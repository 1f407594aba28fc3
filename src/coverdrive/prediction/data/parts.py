"""Many rows are worked on part by part where values on the way would take much memory.

Few get rows of zeros after them, so that what JAX compiles serves for other numbers, too.
"""

import math

import numpy as np
from jax import Array
from jaxtyping import Float32, Shaped

PART = 2**16
"""rows of a part"""


def parts(rows: int) -> list[slice]:
    """The parts of so many rows, in their order."""
    return [slice(first, min(first + PART, rows)) for first in range(0, rows, PART)]


def aligned(*shape: int) -> Float32[np.ndarray, "..."]:
    """Room that JAX takes as it is, as it begins at a multiple of 64 bytes; of what does not, it makes a copy."""
    size = math.prod(shape)
    room = np.empty(size + 16, dtype=np.float32)
    first = -room.ctypes.data // 4 % 16
    return room[first : first + size].reshape(shape)


def padded(values: Shaped[Array | np.ndarray, "N *rest"]) -> Shaped[Array | np.ndarray, "R *rest"]:
    """Followed by zeros up to a power of two, unless they are more than a part."""
    room = (1 << (len(values) - 1).bit_length()) - len(values)
    return np.pad(values, [(0, room)] + [(0, 0)] * (values.ndim - 1)) if len(values) <= PART else values
