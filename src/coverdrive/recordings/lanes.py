"""Lane edges of a straight road from the lateral positions of the vehicles in each lane."""

import numpy as np
from jaxtyping import Float, Int

LANE_WIDTH = 3.6576
"""[m] 12 ft, the lane width of US freeways (AASHTO), where the recording does not name lanes"""

RARE = 0.02
"""A lane with a smaller share of the rows is a ramp and not part of the road"""


def edges_from_lanes(right: Float[np.ndarray, " R"], lane: Int[np.ndarray, " R"]) -> Float[np.ndarray, " edges"]:
    """Edges half-way between the median positions of neighbouring lanes.

    Lanes that are rare, or so close to a more frequent one that they cannot lie beside it, are left out.

    Args:
        right: [m] distance of every vehicle's centre from the left edge, to the right.
        lane: the lane that the recording names.

    Returns:
        Edges [m] in the same direction, ascending.

    """
    names, inverse, rows = np.unique(lane, return_inverse=True, return_counts=True)
    centres = np.array([np.median(right[inverse == index]) for index in range(len(names))])
    kept: list[float] = []
    for index in np.argsort(-rows, kind="stable"):
        if rows[index] >= RARE * len(right) and all(abs(centres[index] - other) > LANE_WIDTH / 2 for other in kept):
            kept.append(float(centres[index]))
    inner = np.sort(kept)
    widths = np.diff(inner) if len(inner) > 1 else np.array([LANE_WIDTH])
    middles = (inner[:-1] + inner[1:]) / 2
    return np.concatenate([[inner[0] - widths[0] / 2], middles, [inner[-1] + widths[-1] / 2]])


def edges_from_width(right: Float[np.ndarray, " R"]) -> Float[np.ndarray, " edges"]:
    """Edges of 12 ft lanes from the left edge on, as many as are needed to hold all but 2 % of the rows.

    Args:
        right: [m] distance of every vehicle's centre from the left edge, to the right.

    """
    lanes = max(1, int(np.ceil(np.quantile(right, 1 - RARE) / LANE_WIDTH)))
    return np.arange(lanes + 1) * LANE_WIDTH
