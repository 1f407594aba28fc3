"""Post-bloating with discarded samples: smaller sets for a larger, still exact, bound.

Up to r calibration units are discarded, and the thresholds are then taken as in post-bloating. By Theorem 2.1 of Campi
and Garatti (2011), P{violation > ε} ≤ C(M + r − 1, r)·Φ(ε, M + r − 1, N₂), whatever chooses the discarded units, as
long as the thresholds miss them all and r is fixed beforehand; discarding fewer only lowers the thresholds. Units that
leave the cover's tube are missed by any thresholds: they are discarded first, so that no separate bound on the cover is
needed.

The rest is greedy. Raising the threshold of one base to its next score costs the units that have the present one; each
step takes what shrinks the sets most for each unit that it costs, on the calibration scores.
"""

from collections import defaultdict, deque
from collections.abc import Iterator, Set
from itertools import islice, takewhile
from typing import NamedTuple

import numpy as np

from coverdrive.certificates.bounds import discarding_bound, discards_allowed, violation_bound
from coverdrive.certificates.calibration import Calibration, Claim, refusal
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Thresholds


def discard(calibration: Calibration, claim: Claim) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss as many calibration units as the bound ε of the claim allows, and that on missing a new one.

    Too few units, or more outside the tube than may be missed, are a `CertificateError`.
    """
    support, count = calibration.bases, len(calibration)
    least = violation_bound(claim.sure, support, count)
    allowed = discards_allowed(claim.bound, claim.sure, support, count)
    if calibration.uncovered > allowed:
        raise refusal(calibration.kind, count, calibration.uncovered, claim.bound, allowed, least)
    rule = _greedy(calibration, allowed - calibration.uncovered)
    bound = discarding_bound(claim.sure, support, allowed, count)
    asking = calibration.covered[calibration.demands.unit]
    unseen = calibration.bases - len(np.unique(calibration.demands.base[asking]))
    return rule, calibration.certificate("discarding", bound, claim, rule=rule, unseen_bases=unseen)


def _greedy(calibration: Calibration, budget: int) -> Thresholds:
    """The tightest rule for what is left after greedily discarding at most ``budget`` covered units."""
    queues = _Queues(calibration)
    columns = np.sort(calibration.samples.scores, axis=0)

    def size(base: int, without: Set[int] = frozenset()) -> float:
        """Windows whose set holds the base; infinite if nothing is left that holds the rule."""
        lowest = queues.first(base, without)
        if np.isinf(lowest):
            return np.inf
        return float(len(columns) - np.searchsorted(columns[:, base], lowest))

    def step(base: int) -> _Step:
        """What the next step of a base would cost and bring."""
        asks = set(queues.asking(base, queues.first(base), budget + 1))
        shrunk = set().union(*(queues.bases_of[unit] for unit in asks))
        if not 0 < len(asks) <= budget:
            return _Step(asks, shrunk, 0.0)
        return _Step(asks, shrunk, sum(size(base) - size(base, asks) for base in shrunk) / len(asks))

    steps = [step(base) for base in range(calibration.bases)]
    while budget > 0:
        best = max(steps, key=lambda each: each.rate if len(each.asks) <= budget else 0.0)
        if best.rate <= 0 or len(best.asks) > budget:
            break
        queues.gone |= best.asks
        budget -= len(best.asks)
        for base, each in enumerate(steps):
            if each.shrunk & best.shrunk:
                steps[base] = step(base)
    return Thresholds.at(np.array([queues.first(base) for base in range(calibration.bases)]), calibration.tube)


class _Step(NamedTuple):
    """Discarding the units that ask for the lowest score of a base: how much sets of which bases shrink."""

    asks: set[int]
    shrunk: set[int]
    rate: float


class _Queues:
    """The scores of each base that covered units ask for, lowest first, less what discarded units did."""

    def __init__(self, calibration: Calibration):
        """Sort the demands."""
        covered = calibration.covered[calibration.demands.unit]
        unit, base, score = (each[covered] for each in calibration.demands)
        self.gone: set[int] = set()
        self.bases_of: dict[int, set[int]] = defaultdict(set)
        for asking, asked in zip(unit.tolist(), base.tolist(), strict=True):
            self.bases_of[asking].add(asked)
        self._queue = [
            deque(sorted(zip(score[base == each].tolist(), unit[base == each].tolist(), strict=True)))
            for each in range(calibration.bases)
        ]

    def first(self, base: int, without: Set[int] = frozenset()) -> float:
        """The lowest score, leaving out some units; infinite if nobody asks."""
        return next((score for score, unit in self._remaining(base) if unit not in without), np.inf)

    def asking(self, base: int, score: float, most: int) -> list[int]:
        """At most so many units that ask for a score no higher than this."""
        low = takewhile(lambda entry: entry[0] <= score, self._remaining(base))
        return [unit for _, unit in islice(low, most)]

    def _remaining(self, base: int) -> Iterator[tuple[float, int]]:
        entries = self._queue[base]
        while entries and entries[0][1] in self.gone:
            entries.popleft()
        return (entry for entry in entries if entry[1] not in self.gone)
