"""Post-bloating with discarded samples: smaller sets for a larger, still exact, bound.

Up to r calibration units are discarded, and the thresholds are then taken as in post-bloating. By Theorem 2.1 of
Campi and Garatti (2011), P{violation > ε} ≤ C(M + r − 1, r)·Φ(ε, M + r − 1, N₂), whatever chooses the discarded units,
as long as the thresholds miss them all and r is fixed beforehand. Units that leave the tube are missed by any
thresholds: they are discarded first, so that no separate bound on the cover is needed. (They are samples like all
others if their score is read as a negative one.) Discarding fewer than r only lowers the thresholds, and the bound
still holds.

The rest is greedy. Raising the threshold of one base to its next score costs the units that have the present one; each
step raises the threshold that shrinks the sets most for each unit that it costs, on the calibration scores.
"""

from collections import defaultdict
from collections.abc import Iterator, Set
from itertools import islice, takewhile

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import check_confidence, discarding_bound, discards_allowed, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.units import Units, calibration_units, number_discarded
from coverdrive.errors import CertificateError


def discard(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    discarded: int | None = None,
    epsilon: float | None = None,
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss at most r calibration units, and the bound on missing a new one.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed beforehand.
        trained_on: keys of the vehicles that trained the network.
        discarded: number r ≥ 0 of units that may be missed, fixed beforehand. Give this, or ``epsilon``.
        epsilon: the bound; r is the greatest number that stays within it.
        confidence: of the bound, in (0, 1).
        unit: what the bound counts.
        seed: of the draw of one window of every vehicle, where these are the unit.

    Raises:
        CertificateError: calibration samples trained the network, there are too few of them, or more than r of them
            leave the tube.
    """
    check_confidence(confidence)
    units = calibration_units(samples, tube, trained_on, unit, seed)
    support, count = units.bases, len(units)
    least = violation_bound(confidence, support, count)
    allowed = number_discarded(
        discarded, epsilon, lambda bound: discards_allowed(bound, confidence, support, count), least, count
    )
    outside = int((~units.covered).sum())
    if outside > allowed:
        raise CertificateError(
            f"{outside} of {count} calibration {unit}s leave the tube around their base, but only {allowed} may be "
            "missed; allow more, or widen the tube or refine the basis"
        )
    rule = Thresholds.at(_raise_thresholds(units, allowed - outside), tube)
    bound = discarding_bound(confidence, support, allowed, count)
    asked = np.zeros(units.bases, dtype=bool)
    asked[units.base[units.covered[units.unit]]] = True
    return rule, units.certificate(
        "post-bloating with discarded samples", rule, bound, confidence, unseen_bases=int((~asked).sum())
    )


def _raise_thresholds(units: Units, budget: int) -> Float[np.ndarray, " M"]:
    """Lowest remaining score of every base after greedily discarding at most ``budget`` covered units."""
    queues = _Queues(units)
    columns = np.sort(units.samples.scores, axis=0)
    while budget > 0:
        best: set[int] = set()
        best_gain = 0.0
        for base in range(units.bases):
            lowest = queues.first(base)
            asks = set(queues.asking(base, lowest, budget + 1))
            if not 0 < len(asks) <= budget:
                continue
            gain = sum(
                _between(columns[:, other], queues.first(other), queues.first(other, asks))
                for other in set().union(*(queues.bases_of[unit] for unit in asks))
            )
            if gain / len(asks) > best_gain:
                best, best_gain = asks, gain / len(asks)
        if not best:
            break
        queues.gone |= best
        budget -= len(best)
    return np.array([queues.first(base) for base in range(units.bases)])


def _between(column: Float[np.ndarray, " N"], low: float, high: float) -> float:
    """How many windows lose the base when its threshold rises; −∞ if nothing would be left to hold the threshold."""
    if np.isinf(high):
        return -np.inf
    return float(np.searchsorted(column, high) - np.searchsorted(column, low))


class _Queues:
    """For every base, the scores that covered units ask for, in rising order, less those of discarded units."""

    def __init__(self, units: Units):
        """Sort the demands."""
        covered = units.covered
        self.gone: set[int] = set()
        self.bases_of: dict[int, set[int]] = defaultdict(set)
        self._queue: list[list[tuple[float, int]]] = [[] for _ in range(units.bases)]
        self._head = [0] * units.bases
        for at in np.argsort(units.score, kind="stable"):
            unit, base = int(units.unit[at]), int(units.base[at])
            if covered[unit]:
                self.bases_of[unit].add(base)
                self._queue[base].append((float(units.score[at]), unit))

    def first(self, base: int, without: Set[int] = frozenset()) -> float:
        """Lowest score that is asked for, leaving out some units; infinite if nobody asks."""
        return next((score for score, unit in self._remaining(base) if unit not in without), np.inf)

    def asking(self, base: int, score: float, most: int) -> list[int]:
        """At most so many units that ask for no more than a score."""
        low = takewhile(lambda entry: entry[0] <= score, self._remaining(base))
        return [unit for _, unit in islice(low, most)]

    def _remaining(self, base: int) -> Iterator[tuple[float, int]]:
        queue = self._queue[base]
        while self._head[base] < len(queue) and queue[self._head[base]][1] in self.gone:
            self._head[base] += 1
        rest = islice(queue, self._head[base], None)
        return (entry for entry in rest if entry[1] not in self.gone)
