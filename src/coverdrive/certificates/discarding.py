"""Post-bloating with discarded samples: smaller sets for a larger, still exact, bound.

Up to r calibration units are discarded, and the thresholds are then taken as in post-bloating. By Theorem 2.1 of
Campi and Garatti (2011), P{violation > ε} ≤ C(M + r − 1, r)·Φ(ε, M + r − 1, N₂), whatever chooses the discarded units,
as long as the thresholds miss them all and r is fixed beforehand. Units that leave the cover's tube are missed by any
thresholds: they are discarded first, so that no separate bound on the cover is needed. (They are samples like all
others if their score is read as a negative one.) Discarding fewer than r only lowers the thresholds, and the bound
still holds. With a tube for each base, there are 2M decision variables.

The rest is greedy. Raising the threshold of one base to its next score, or shrinking its tube to its next distance,
costs the units that have the present one; each step takes what shrinks the sets most for each unit that it costs, on
the calibration scores. The size of a set is the sum of the radii of its bases.
"""

from collections import defaultdict
from collections.abc import Iterator, Set
from itertools import islice, takewhile
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bounds import check_confidence, discarding_bound, discards_allowed, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted, Tubes
from coverdrive.certificates.rule import ROUNDING, Thresholds
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
    tubes: Tubes = "cover",
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
        tubes: whether the tube of every base shrinks to what the remaining units need.

    Raises:
        CertificateError: calibration samples trained the network, there are too few of them, or more than r of them
            leave the tube.
    """
    check_confidence(confidence)
    units = calibration_units(samples, tube, trained_on, unit, seed)
    support, count = units.bases * (2 if tubes == "per base" else 1), len(units)
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
    rule = _greedy(units, tubes, allowed - outside)
    bound = discarding_bound(confidence, support, allowed, count)
    asked = np.zeros(units.bases, dtype=bool)
    asked[units.base[units.covered[units.unit]]] = True
    return rule, units.certificate(
        "post-bloating with discarded samples",
        rule,
        bound,
        confidence,
        unseen_bases=int((~asked).sum()),
        tubes=tubes,
    )


def _greedy(units: Units, tubes: Tubes, budget: int) -> Thresholds:
    """The tightest rule for what is left after greedily discarding at most ``budget`` covered units."""
    bases = units.bases
    queues = _Queues(units, tubes)
    columns = np.sort(units.samples.scores, axis=0)

    def size(base: int, without: Set[int] = frozenset()) -> float:
        """Windows whose set holds the base, times its radius; infinite if nothing is left that holds the rule."""
        lowest = queues.first(base, without)
        if np.isinf(lowest):
            return np.inf
        return float(len(columns) - np.searchsorted(columns[:, base], lowest)) * queues.radius(base, without)

    def step(queue: int) -> _Step:
        """What the next step in a queue would cost and bring."""
        asks = set(queues.asking(queue, queues.first(queue), budget + 1))
        shrunk = set().union(*(queues.bases_of[unit] for unit in asks))
        if not 0 < len(asks) <= budget:
            return _Step(asks, shrunk, 0.0)
        return _Step(asks, shrunk, sum(size(base) - size(base, asks) for base in shrunk) / len(asks))

    steps = [step(queue) for queue in range(len(queues))]
    while budget > 0:
        best = max(steps, key=lambda each: each.rate if len(each.asks) <= budget else 0.0)
        if best.rate <= 0 or len(best.asks) > budget:
            break
        queues.gone |= best.asks
        budget -= len(best.asks)
        for queue, each in enumerate(steps):
            if each.shrunk & best.shrunk:
                steps[queue] = step(queue)
    lowest = np.array([queues.first(base) for base in range(bases)])
    radii = [queues.radius(base) for base in range(bases)]
    return Thresholds.at(lowest, np.minimum(np.array(radii) + ROUNDING, units.tube))


class _Step(NamedTuple):
    """Discarding all units that ask for the tightest demand of a queue."""

    asks: set[int]
    """these units"""
    shrunk: set[int]
    """bases that they drove"""
    rate: float
    """by how much the sets shrink for each of them"""


class _Queues:
    """What covered units ask for, tightest first, less what discarded units did.

    Queue j < M holds the scores of base j. With a tube for each base, queue M + j holds the distances from it, negated.
    """

    def __init__(self, units: Units, tubes: Tubes):
        """Sort the demands."""
        covered = units.covered[units.unit]
        unit, base = units.unit[covered], units.base[covered]
        self.gone: set[int] = set()
        self.bases_of: dict[int, set[int]] = defaultdict(set)
        for at in range(len(unit)):
            self.bases_of[int(unit[at])].add(int(base[at]))
        self._bases, self._tube = units.bases, units.tube
        demands = [units.score[covered]] + ([-units.distance[covered]] if tubes == "per base" else [])
        self._queue = [
            sorted(zip(demanded[base == each].tolist(), unit[base == each].tolist(), strict=True))
            for demanded in demands
            for each in range(units.bases)
        ]
        self._head = [0] * len(self._queue)

    def __len__(self) -> int:
        """Number of queues, M or 2M."""
        return len(self._queue)

    def first(self, queue: int, without: Set[int] = frozenset()) -> float:
        """The tightest demand, leaving out some units; infinite if nobody asks."""
        return next((demand for demand, unit in self._remaining(queue) if unit not in without), np.inf)

    def radius(self, base: int, without: Set[int] = frozenset()) -> float:
        """Radius that the tube of a base needs, leaving out some units; that of the cover if nobody asks."""
        if len(self) == self._bases:
            return self._tube
        return min(self._tube, abs(self.first(self._bases + base, without)))

    def asking(self, queue: int, demand: float, most: int) -> list[int]:
        """At most so many units that ask for no less than a demand."""
        low = takewhile(lambda entry: entry[0] <= demand, self._remaining(queue))
        return [unit for _, unit in islice(low, most)]

    def _remaining(self, queue: int) -> Iterator[tuple[float, int]]:
        entries = self._queue[queue]
        while self._head[queue] < len(entries) and entries[self._head[queue]][1] in self.gone:
            self._head[queue] += 1
        rest = islice(entries, self._head[queue], None)
        return (entry for entry in rest if entry[1] not in self.gone)
