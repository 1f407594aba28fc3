"""Lane edges from what a recording tells: the lane of every row, or only where vehicles drive.

R is the number of rows; positions across the road count to the right or to the left alike.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float, Num

LANE_WIDTH = 3.6576
"""[m] 12 ft, the lane width of US freeways (AASHTO), where the recording does not name lanes"""

RARE = 0.02
"""A lane with a smaller share of the rows is not taken as one that goes on; it may be a ramp"""

NARROWEST, WIDEST = 2.7, 4.3
"""[m] lanes that are looked for in tracks; those of motorways are 3.25 to 3.75 m wide"""

LEAST_SHARE, FILLED_IN = 0.9, 3.0
"""Share of the usual width, or width [m] if that is less, of two lanes of which nobody is seen in one: where there is
less place, a ramp is beyond a wedge"""

MOST_LANES = 20
"""The widest roads have fewer lanes in one direction"""

ORDERED = 0.8
"""Correlation with positions across the road above which numbers of lanes grow in one direction"""


def edges_from_lanes(right: Float[np.ndarray, " R"], lane: Num[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges [m] half-way between the median positions of neighbouring lanes, ascending; None if they cannot be told.

    ``right`` [m] is the distance of every vehicle's centre from the left edge, ``lane`` the lane that the recording
    names. Lanes that are rare, or so close to a more frequent one that they cannot lie beside it, are left out; those
    whose numbers are missing between two others are filled in. No lane is frequent, or two are too far apart: None.
    """
    names, rows = np.unique(lane, return_counts=True)
    kept = dict[float, float]()
    for index in np.argsort(-rows, kind="stable")[: round(1 / RARE)]:
        if rows[index] >= RARE * len(right):
            centre = float(np.median(right[lane == names[index]]))
            if all(abs(centre - other) > LANE_WIDTH / 2 for other in kept):
                kept[centre] = float(names[index])
    centres = _with_empty_lanes(kept)
    return None if centres is None else edges_from_centres(centres)


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


def _with_empty_lanes(names: dict[float, float]) -> Float[np.ndarray, " L"] | None:
    """Centres [m] of lanes whose numbers are known, ascending, and of those between them in which nobody drives.

    None if there is no lane, or numbers that leave no lane out are too far apart.
    """
    centres = sorted(names)
    beside = [after - before for before, after in pairwise(centres) if after - before < 2 * NARROWEST]
    usual = float(np.median(beside or LANE_WIDTH))
    found = centres[:1]
    for before, after in pairwise(centres):
        numbers = sorted((names[before], names[after]))
        missing = round(numbers[1] - numbers[0]) > 1 and not any(
            numbers[0] < each < numbers[1] for each in names.values()
        )
        lanes = _lanes_between(after - before, numbers[1] - numbers[0] if missing else 1.0, usual)
        if lanes is None:
            return None
        found += np.linspace(before, after, lanes + 1)[1:].tolist()
    return np.array(found) if found else None


def _lanes_between(way: float, step: float, usual: float) -> int | None:
    """How many lanes it is from one centre to another: as many as their numbers say, if lanes are as wide as that.

    Else as many as come nearest to the usual width [m]. None if lanes would be too wide.
    """
    if not 2 * max(NARROWEST, min(LEAST_SHARE * usual, FILLED_IN)) <= way <= MOST_LANES * WIDEST:
        return 1  # no other lane has place between them, or they lie on no road, which is refused with its width
    if step < 2:  # a ramp beyond a wedge
        return 1 if way <= 2 * WIDEST else None
    fitting = [lanes for lanes in range(2, MOST_LANES + 1) if NARROWEST <= way / lanes <= WIDEST]
    return min(fitting, key=lambda lanes: (lanes != step, abs(way / lanes - usual)))


def order_of(lane: Num[np.ndarray, " R"], across: Float[np.ndarray, " R"]) -> int:
    """Whether the numbers of lanes grow with the positions [m] across the road (1), against them (−1), or neither."""
    alike = np.mean((lane - lane.mean()) * (across - across.mean())) / max(float(lane.std() * across.std()), 1e-9)
    return 0 if abs(alike) < ORDERED else int(np.sign(alike))


def edges_from_centres(centres: Float[np.ndarray, " L"]) -> Float[np.ndarray, " edges"]:
    """Edges half-way between the centres [m] of neighbouring lanes, and as far outside of the outermost; ascending."""
    inner = np.sort(centres)
    widths = np.diff(inner) if len(inner) > 1 else np.array([LANE_WIDTH])
    middles = (inner[:-1] + inner[1:]) / 2
    return np.concatenate([[inner[0] - widths[0] / 2], middles, [inner[-1] + widths[-1] / 2]])
