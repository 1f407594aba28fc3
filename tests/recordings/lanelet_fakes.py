"""Lanelets of small networks, drawn along the x axis."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from coverdrive.recordings.roads.drawn_road import DrawnLane


def piece(number: int, start: float, end: float, left: float, left_end: float | None = None, **links: Any) -> Any:
    """A lanelet 3.5 m wide whose left bound leads evenly from one y to another."""
    x, y = np.linspace(start, end, 20), np.linspace(left, left if left_end is None else left_end, 20)
    bounds = {"left_vertices": np.stack([x, y], -1), "right_vertices": np.stack([x, y - 3.5], -1)}
    none = {"adj_left": None, "adj_right": None, "adj_left_same_direction": None, "adj_right_same_direction": None}
    return SimpleNamespace(
        lanelet_id=number, distance=np.array([0.0, abs(end - start)]),
        **({"predecessor": [], "successor": []} | bounds | none | links),
    )  # fmt: skip


def side(**beside: int) -> dict[str, Any]:
    """Links to lanelets beside, driven in the same direction."""
    found = {f"adj_{name}": number for name, number in beside.items()}
    return found | {f"adj_{name}_same_direction": True for name in beside}


def ends(lane: DrawnLane) -> list[list[float]]:
    return [lane.left[0].tolist(), lane.left[-1].tolist()]
