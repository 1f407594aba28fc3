"""Many rows are worked on part by part where values on the way would take much memory."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Shaped

PART = 2**16
"""rows of a part"""


def parts(rows: int) -> list[slice]:
    """The parts of so many rows, in their order."""
    return [slice(first, min(first + PART, rows)) for first in range(0, rows, PART)]


def part_by_part(
    function: Callable[[Shaped[np.ndarray, "n *before"]], Any], rows: Shaped[np.ndarray, "N *before"]
) -> Shaped[np.ndarray, "N *after"]:
    """What a function gives for rows that do not depend on each other, of which there is at least one.

    It is put where it is to stay at once: a list of parts, once put together, leaves memory in pieces behind.
    """
    result = None
    for part in parts(len(rows)):
        found = np.asarray(function(rows[part]))
        result = np.empty((len(rows), *found.shape[1:]), found.dtype) if result is None else result
        result[part] = found
    assert result is not None
    return result
