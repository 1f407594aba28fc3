"""The road of a route that leaves a lane where that ends, or for one that begins: along the border between the two.

An acceleration lane ends beside the road that one wants to be on, and the lane of an exit begins beside that which one
comes from: no chain of lanelets leads from one end of such a route to the other, but a border does, the left bound of
some lanelets and the right bound of others. What is to its right leads the road, and has no width where nothing is.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.recordings.roads.drawn_road import DrawnLane
from coverdrive.recordings.roads.lanelets import SEAM, drawn, joined, kink, links_of

_Border = tuple[int | None, int | None]
"""The numbers of the lanelets to the left and to the right of a bound"""


def lanes_along_border(lanelets: list[Any], starts: Collection[int], ends: Collection[int]) -> list[DrawnLane] | None:
    """All lanes, first what is to the right of the border that leads from some lanelets to others; None: none does.

    A KeyError if a lanelet names one that is not there.
    """
    parts = {part.lanelet_id: part for part in lanelets}
    after, before = links_of(parts)
    right_of = {n: part.adj_right for n, part in parts.items() if part.adj_right_same_direction}
    right_of |= {part.adj_left: n for n, part in parts.items() if part.adj_left_same_direction}
    left_of = {right: left for left, right in right_of.items()}

    def borders(number: int) -> tuple[_Border, _Border]:
        return (left_of.get(number), number), (number, right_of.get(number))

    def line(border: _Border) -> Float[np.ndarray, "P 2"]:
        left, right = border
        return parts[left].right_vertices if right is None else parts[right].left_vertices

    def steps(border: _Border, links: dict[int, list[int]]) -> Iterator[_Border]:
        for side, number in enumerate(border):
            for other in links[number] if number is not None else ():
                found, ends = borders(other)[1 - side], slice(None, None, 1 if links is after else -1)
                if np.hypot(*(line(border)[ends][-1] - line(found)[ends][0])) < SEAM / 2:
                    yield found

    def straightest(border: _Border, links: dict[int, list[int]]) -> _Border | None:
        way = slice(None, None, 1 if links is after else -1)
        return min(steps(border, links), key=lambda each: kink(line(border)[way], line(each)[way]), default=None)

    path = _shortest(
        [each for n in sorted(starts) for each in borders(n)],
        {each for n in ends for each in borders(n)},
        lambda border: steps(border, after),
    )
    if path is None:
        return None
    for links, end in ((after, -1), (before, 0)):
        while (further := straightest(path[end], links)) and further not in path:
            path.insert(len(path) if end else 0, further)
    left = np.concatenate([line(each) for each in path])
    right = np.concatenate([line(each) if each[1] is None else parts[each[1]].right_vertices for each in path])
    others = joined(parts, after, {n for _, n in path if n is not None})
    return [DrawnLane(left, right), *(drawn([parts[number] for number in chain]) for chain in others)]


def _shortest(
    starts: Collection[_Border], ends: Collection[_Border], steps: Callable[[_Border], Iterator[_Border]]
) -> list[_Border] | None:
    """A shortest path of borders."""
    paths, seen = deque([each] for each in starts), set(starts)
    while paths:
        path = paths.popleft()
        if path[-1] in ends:
            return path
        for border in steps(path[-1]):
            if border not in seen:
                seen.add(border)
                paths.append([*path, border])
    return None
