"""The lanes of a lanelet network: its main carriageway, and all other lanelets joined to lanes.

A lanelet is a piece of a lane; it names those before and after it, and those beside it. The road follows the longest
chain of lanelets, in which every lanelet counts as often as there are lanes beside it.
"""

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from coverdrive.errors import DataError
from coverdrive.recordings.roads.drawn_road import DrawnLane

AS_LONG = 0.95
"""Share of the longest chain from which on a chain farther left is the main one: lanes of a bend differ in length"""

MOST_BESIDE = 50
"""Lanelets beside one another, at most; no road is as wide"""

SEAM = 4.0
"""[m] by which the bounds of a lanelet may miss those of the next, in all; others do not follow one another"""

KINK = 1.5
"""[m] by which the next lanelet may miss the one that goes straight on, its two bounds together, over 10 m"""

Links = dict[int, list[int]]
"""The numbers of lanelets that follow on each"""

Neighbours = dict[tuple[int, str], list[int]]
"""The numbers of lanelets on each side of each, the nearest first"""

_BOUNDS = ("left_vertices", "right_vertices")


def carriageways(lanelets: list[Any], through: Sequence[Collection[int]] = ()) -> Iterator[list[DrawnLane]]:
    """All lanes, the leftmost one of a carriageway first: of the main one, then of the next, and so on.

    Before them comes the one along a route, if ``through`` has the numbers of its lanelets, and of those among them of
    which it leads through one. A KeyError if a lanelet names one that is not there, a DataError if one lies beside
    itself.
    """
    parts = {part.lanelet_id: part for part in lanelets}
    after, before = links_of(parts)
    beside = {(number, side): _beside(parts, number, side) for number in parts for side in ("left", "right")}

    def lanes(guide: list[int]) -> list[DrawnLane]:
        return [drawn([parts[number] for number in chain]) for chain in (guide, *joined(parts, after, guide))]

    if through:
        route, by = through
        onwards, back = (
            {number: [each for each in links[number] if each in route] for number in parts} for links in (after, before)
        )
        yield lanes(_guide(parts, onwards, back, beside, set(by)))
    left = set(parts)
    while left:
        guide = _guide(parts, after, before, beside, left)
        left -= {other for number in guide for side in ("left", "right") for other in (number, *beside[number, side])}
        yield lanes(guide)


def links_of(parts: dict[int, Any]) -> tuple[Links, Links]:
    """The lanelets that follow on each, and those that each follows on, of some by their numbers.

    A KeyError if a lanelet names one that is not there.
    """
    stated = {(first, second) for second, part in parts.items() for first in part.predecessor}
    stated |= {(first, second) for first, part in parts.items() for second in part.successor}
    after: Links = {number: [] for number in parts}
    before: Links = {number: [] for number in parts}
    for first, second in sorted(stated):
        if _seam(parts[first], parts[second]) < SEAM:
            after[first].append(second)
            before[second].append(first)
    return after, before


def drawn(chain: list[Any]) -> DrawnLane:
    """The lane of lanelets that follow one another."""
    return DrawnLane(*(np.concatenate([getattr(part, bound) for part in chain]) for bound in _BOUNDS))


def _guide(parts: dict[int, Any], after: Links, before: Links, beside: Neighbours, free: set[int]) -> list[int]:
    """The chain of lanelets that a road follows, of those that are free."""
    weight = {
        number: float(part.distance[-1]) * (1 + len(beside[number, "left"]) + len(beside[number, "right"]))
        for number, part in parts.items()
    }
    ahead, behind = _longest(weight, after), _longest(weight, before)
    through = {number: ahead[number] + behind[number] - weight[number] for number in free}
    most = max(through.values())
    part = max((number for number in free if through[number] >= most * (1 - 1e-9)), key=weight.__getitem__)
    across = [*reversed(beside[part, "left"]), part, *beside[part, "right"]]
    lanes = [number for number in across if through.get(number, 0.0) >= AS_LONG * most]
    chains = [_through(parts, number, (after, ahead), (before, behind)) for number in lanes]
    return min(chains, key=lambda chain: _kinks(parts, chain))  # of equal ones the leftmost


def _through(
    parts: dict[int, Any], part: int, onwards: tuple[Links, dict[int, float]], back: tuple[Links, dict[int, float]]
) -> list[int]:
    """The chain through a lanelet: the heaviest, and of chains that are about as heavy the one that bends least."""
    chain, taken = [part], {part}
    for (links, weights), end in ((onwards, -1), (back, 0)):
        while found := [number for number in links[chain[end]] if number not in taken]:
            least = AS_LONG * max(weights[number] for number in found)
            seams = {n: (chain[end], n) if end else (n, chain[end]) for n in found if weights[n] >= least}
            chosen = min(seams, key=lambda n: _misfit(*(parts[each] for each in seams[n])))
            chain.insert(len(chain) if end else 0, chosen)
            taken.add(chosen)
    return chain


def _kinks(parts: dict[int, Any], chain: list[int]) -> float:
    """[m] by which the lanelets of a chain miss those that go straight on, in all; digitised lines always do a bit."""
    misfits = (_misfit(parts[first], parts[second]) for first, second in pairwise(chain))
    return sum(misfit for misfit in misfits if misfit > KINK)


def joined(parts: dict[int, Any], after: Links, guide: Collection[int]) -> Iterator[list[int]]:
    """All lanelets but those of a guide in chains, at forks and merges as they fit best."""
    rest = dict.fromkeys(parts)
    for number in guide:
        del rest[number]
    pairs = [(one, other) for one in rest for other in after[one] if other in rest]
    worst_first = sorted(((_misfit(parts[one], parts[other]), one, other) for one, other in pairs), reverse=True)
    following: dict[int | None, int] = {one: other for _, one, other in worst_first}
    leading: dict[int | None, int] = {other: one for _, one, other in worst_first}
    for number in rest:
        if following.get(leading.get(number)) != number:
            chain = [number]
            while (other := following.get(chain[-1])) is not None and leading[other] == chain[-1]:
                chain.append(other)
            yield chain


def _longest(weight: dict[int, float], links: Links) -> dict[int, float]:
    """The weight of the heaviest chain from every lanelet on along its links; a circle counts once.

    Every lanelet is looked at twice, before and after those that its links lead to.
    """
    longest, seen = dict[int, float](), set[int]()
    stack = list(weight)
    while stack:
        number = stack[-1]
        if number not in seen:
            seen.add(number)
            stack += [other for other in links[number] if other not in seen]
            continue
        if number not in longest:
            longest[number] = weight[number] + max((longest.get(other, 0.0) for other in links[number]), default=0.0)
        stack.pop()
    return longest


def _beside(parts: dict[int, Any], number: int, side: str) -> list[int]:
    """The lanelets on a side that are driven in the same direction, the nearest first."""
    found = [number]
    while getattr(parts[found[-1]], f"adj_{side}_same_direction"):
        other = getattr(parts[found[-1]], f"adj_{side}")
        if other in found:
            raise DataError(f"lanelet {other} lies beside itself; check the adjacent lanelets")
        if other not in parts:
            raise KeyError(other)
        found.append(other)
        if len(found) > MOST_BESIDE:
            raise DataError(f"lanelet {number} has more than {MOST_BESIDE} beside it; check the adjacent lanelets")
    return found[1:]


def _seam(first: Any, second: Any) -> float:
    """[m] by which the bounds of a lanelet end before or beside those of the one after it."""
    return sum(float(np.hypot(*(getattr(first, bound)[-1] - getattr(second, bound)[0]))) for bound in _BOUNDS)


def _misfit(first: Any, second: Any) -> float:
    """[m] by which the bounds of a lanelet and of the one after it bend, from 10 m before the seam to 10 m after it."""
    return sum(kink(getattr(first, bound), getattr(second, bound)) for bound in _BOUNDS)


def kink(first: np.ndarray, second: np.ndarray) -> float:
    """[m] by which a polyline and one after it bend, from 10 m before the seam to 10 m after it."""
    return float(np.hypot(*(_along(first[::-1]) + _along(second) - 2 * second[0])))


def _along(points: np.ndarray) -> np.ndarray:
    """The point 10 m along a polyline, or its last one."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return np.array([np.interp(10.0, way, values) for values in points.T])
