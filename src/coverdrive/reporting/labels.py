"""Where the labels of many lines are written: near their ends, without overlap."""

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import isotonic_regression

MOST = 24
"""labels that find room beside a plot"""


def spread(values: Float[np.ndarray, " N"], apart: float) -> Float[np.ndarray, " N"]:
    """Places at least ``apart`` from each other, in the order of the values and as near to them as can be."""
    order = np.argsort(values, kind="stable")
    room = apart * np.arange(len(values))
    places = np.empty(len(values))
    places[order] = isotonic_regression(values[order] - room).x + room
    return places


def labelled(share: Float[np.ndarray, " M"]) -> Int[np.ndarray, " _"]:
    """The bases that are labelled: all, or the most common if there are too many."""
    return np.sort(np.argsort(-share, kind="stable")[:MOST])
