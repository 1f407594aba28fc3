"""Lane edges from what a recording tells: the lane of every row, or only where vehicles drive.

R is the number of rows; positions across the road count to the right or to the left alike.
"""

import numpy as np
from jaxtyping import Float, Num

LANE_WIDTH = 3.6576
"""[m] 12 ft, the lane width of US freeways (AASHTO), where the recording does not name lanes"""

RARE = 0.02
"""A lane with a smaller share of the rows is not taken as one that goes on; it may be a ramp"""

NARROWEST, WIDEST = 2.7, 4.3
"""[m] lanes that are looked for in tracks; those of motorways are 3.25 to 3.75 m wide"""

MOST_LANES = 20
"""The widest roads have fewer lanes in one direction"""


def edges_from_lanes(right: Float[np.ndarray, " R"], lane: Num[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges [m] half-way between the median positions of neighbouring lanes, ascending; None if no lane is frequent.

    ``right`` [m] is the distance of every vehicle's centre from the left edge, ``lane`` the lane that the recording
    names. Lanes that are rare, or so close to a more frequent one that they cannot lie beside it, are left out.
    """
    names, rows = np.unique(lane, return_counts=True)
    kept: list[float] = []
    for index in np.argsort(-rows, kind="stable")[: round(1 / RARE)]:
        if rows[index] >= RARE * len(right):
            centre = float(np.median(right[lane == names[index]]))
            if all(abs(centre - other) > LANE_WIDTH / 2 for other in kept):
                kept.append(centre)
    if not kept:
        return None
    return edges_from_centres(np.array(kept))


def edges_from_width(right: Float[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges of 12 ft lanes from the left edge on, as many as hold all but 2 % of the rows; None if too many."""
    lanes = max(1, int(np.ceil(np.quantile(right, 1 - RARE) / LANE_WIDTH)))
    return np.arange(lanes + 1) * LANE_WIDTH if lanes <= MOST_LANES else None


def edges_from_tracks(across: Float[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges [m] of lanes of one width, at which vehicles drive most nearly in the middle; None if there are too many.

    Where all drive within one lane, it has the usual width.
    """
    low, high = np.quantile(across, (RARE / 2, 1 - RARE / 2))
    if high - low < NARROWEST:
        return (low + high) / 2 + LANE_WIDTH * np.array([-0.5, 0.5])
    if not high - low <= MOST_LANES * WIDEST:  # nor if there is no number among them
        return None
    sample = across[:: max(1, len(across) // 20_000)]
    widths = np.arange(NARROWEST, WIDEST, 0.01)
    phase = np.array([np.mean(np.exp(2j * np.pi * sample / width)) for width in widths])
    best = int(np.argmax(np.abs(phase)))
    offset = np.angle(phase[best]) / (2 * np.pi) * widths[best]
    return edges_from_lanes(across, np.rint((across - offset) / widths[best]))


def edges_from_centres(centres: Float[np.ndarray, " L"]) -> Float[np.ndarray, " edges"]:
    """Edges half-way between the centres [m] of neighbouring lanes, and as far outside of the outermost; ascending."""
    inner = np.sort(centres)
    widths = np.diff(inner) if len(inner) > 1 else np.array([LANE_WIDTH])
    middles = (inner[:-1] + inner[1:]) / 2
    return np.concatenate([[inner[0] - widths[0] / 2], middles, [inner[-1] + widths[-1] / 2]])
