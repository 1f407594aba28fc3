r"""How often drives end badly, proved by counting: k events, such as collisions, in n independent drives.

A risk r is proved by rejecting "an event is more probable than r". If n is fixed beforehand, the p-value is Φ(r, k, n)
(`coverdrive.certificates.bounds`). If one looks after every drive and stops as one likes, that rejects too often; the
evidence of a mixture of likelihood ratios does not: with fixed weights on the rates q = c·r below r,

    E(r) = Σ_c w_c c^k ((1 − c·r) / (1 − r))^(n − k)

is, at every rate of at least r, a non-negative supermartingale that starts at 1, so that it ever reaches 1 / β with a
probability of at most β (Ville; method of mixtures, Robbins 1970; for means in general, Waudby-Smith and Ramdas 2024).
E(r) grows with r. What was proved at any moment therefore remains proved, and the smallest limit of all moments holds.
Most of the weight is where few events are expected. Drives that prove a risk of 0.2 % with 99 % confidence:

| events            |     0 |     1 |     2 |     3 |     4 |     5 |     10 |     20 |
|-------------------|-------|-------|-------|-------|-------|-------|--------|--------|
| fixed beforehand  | 2,301 | 3,317 | 4,200 | 5,020 | 5,799 | 6,551 | 10,068 | 16,546 |
| stop at any time  | 2,593 | 4,394 | 5,380 | 6,360 | 7,333 | 8,295 | 12,869 | 20,698 |
"""

import math
from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import takewhile
from typing import Literal, TypeAlias

import numpy as np
import scipy
from jaxtyping import Bool, Float, Int
from scipy import optimize, special

from coverdrive.certificates.bounds import binomial_tail, check_confidence, rate_limit
from coverdrive.percentages import at_most, percent

Procedure: TypeAlias = Literal["named beforehand", "fixed sequence", "Holm", "anytime"]
"""What keeps several candidates from being tried until one passes by chance: there is one; an order fixed beforehand,
up to the first that fails; levels that make up for their number; that order again, each driven until it is proved"""

_PARTS = np.array([0, 0.2, 0.4, 0.6, 0.8])
"""rates that are betted on, as parts of the risk"""

_WEIGHTS = np.array([0.4, 0.4, 0.1, 0.05, 0.05])
"""of these rates"""

_MOST = 2**50
"""drives that are looked at for how many would do"""

Counts: TypeAlias = int | Int[np.ndarray, " moments"]


def log_evidence(events: Counts, drives: Counts, risk: float) -> Float[np.ndarray, "*moments"]:
    """Logarithm of the evidence E(r) that an event is less probable than ``risk``, after so many events in drives."""
    events, drives = np.asarray(events)[..., None], np.asarray(drives)[..., None]
    ratio = np.log1p(-_PARTS * risk) - np.log1p(-risk)
    powers = special.xlogy(events, _PARTS) + (drives - events) * ratio
    return np.asarray(np.logaddexp.reduce(powers + np.log(_WEIGHTS), axis=-1))


def moments(hits: Bool[np.ndarray, " drives"]) -> tuple[Int[np.ndarray, " moments"], Int[np.ndarray, " moments"]]:
    """Events and drives when the evidence is greatest: just before every event, and after all drives."""
    drives = np.r_[np.flatnonzero(hits), len(hits)]
    return np.arange(len(drives)), drives


def proved_at(hits: Bool[np.ndarray, " drives"], risk: float, confidence: float) -> bool:
    """Whether drives, in their order, prove the risk at any moment."""
    return bool(log_evidence(*moments(hits), risk).max() >= -math.log1p(-confidence))


def anytime_limit(events: Counts, drives: Counts, confidence: float) -> float:
    """The smallest risk that is proved, whenever one stops, at one moment or at the best of several of one series.

    It is 1 if none is.
    """
    check_confidence(confidence)
    goal, high = -math.log1p(-confidence), 1 - 1e-15
    if log_evidence(events, drives, high).max() < goal:
        return 1.0
    return float(
        optimize.root_scalar(
            lambda risk: log_evidence(events, drives, risk).max() - goal,
            bracket=(1e-15, high),
            method="brentq",
            xtol=1e-15,
        ).root
    )


def p_value(events: int, drives: int, risk: float, anytime: bool = False) -> float:
    """Of "an event is more probable than ``risk``": for a number of drives fixed beforehand, or 1 / E."""
    if anytime:
        return math.exp(min(0.0, -float(log_evidence(events, drives, risk))))
    return binomial_tail(risk, events, drives)


def drives_needed(events: int, risk: float, confidence: float, anytime: bool = False) -> int:
    """The fewest drives with which so many events prove the risk, with their number fixed beforehand or at any time.

    At any time, they are all together: with the first n, ``drives_needed`` − n more without an event will do.
    """
    check_confidence(confidence)
    numbers = range(events, _MOST)
    level = 1 - confidence
    return events + bisect_left(numbers, True, key=lambda n: p_value(events, n, risk, anytime) <= level)


def pilot_order(
    rates: Float[np.ndarray, "candidates measures"], speeds: Float[np.ndarray, " candidates"], gain: float = 0.0
) -> list[int]:
    """The order in which candidates are to be proved, from pilot drives: from the safest to the fastest.

    It is the Pareto front of what the pilot says of risk and of its mean speed [m/s]: it begins with the least of the
    first measure (among equal ones, of the next one, and then with the slowest), and each is faster than all before it
    by a share ``gain`` at least. A pilot seldom sees any rare event: the fastest of those without one would fail in the
    proof nearly always, and a walk ends with the first that fails.
    """
    order, front, fastest = np.lexsort((speeds, *rates.T[::-1])).tolist(), list[int](), -np.inf
    for candidate in order:
        if speeds[candidate] > fastest * (1 + gain):
            front.append(candidate)
            fastest = speeds[candidate]
    return front


def fixed_sequence(proved: Iterable[bool]) -> int:
    """How many hypotheses are proved before the first that is not, in an order fixed beforehand.

    No later one is looked at, so that each may be tested at the full level (Angelopoulos et al. 2021).
    """
    return sum(1 for _ in takewhile(bool, proved))


def holm(p_values: Float[np.ndarray, " candidates"], confidence: float) -> Bool[np.ndarray, " candidates"]:
    """Which hypotheses are rejected: not even one wrongly, with this confidence (Holm 1979).

    For those that are not, limits at the confidence 1 − β / (number of those) hold together with what is proved
    (Strassburger and Bretz 2008).
    """
    order, count = np.argsort(p_values, kind="stable"), len(p_values)
    passes = p_values[order] <= (1 - confidence) / (count - np.arange(count))
    proved = np.zeros(count, dtype=bool)
    proved[order[: fixed_sequence(passes.tolist())]] = True
    return proved


@dataclass(frozen=True)
class Proof:
    """With ``confidence`` over the drives of the proof, ``event`` is at most as probable as ``bound`` in a new one."""

    event: str
    """what such drives do, as in "touch anybody" """
    events: int
    """drives of the proof that did"""
    drives: int
    """drives of the proof"""
    asked: float
    """the risk that was to be proved"""
    bound: float
    """the risk that is proved; only what is named beforehand may be proved to be below what was asked"""
    confidence: float
    """probability with which the bound holds, whichever candidate is chosen; for this event alone"""
    method: Procedure
    """how the candidate was chosen and proved"""
    unit: str
    """what is counted, as in "20-s drives" """
    level: float | None = None
    """confidence of its single test where that differs, as by Holm"""

    @property
    def reached(self) -> bool:
        """Whether what was asked is proved."""
        return self.bound <= self.asked

    @property
    def more(self) -> int:
        """Drives without an event that would do, too, at any time; else new ones, fixed beforehand, with as many."""
        anytime = self.method == "anytime"
        level = self.confidence if self.level is None else self.level
        needed = drives_needed(self.events, self.asked, level, anytime)
        return 0 if self.reached else needed - self.drives * anytime

    @property
    def chance(self) -> float:
        """That `more` drives go so well, by what these say of their rate: a beta-binomial of Jeffreys' prior.

        Of all that a rate may be beforehand, it is right on average: of dials whose rates are from a twentieth to five
        times the risk, and which 2,301 or 2,600 drives do not prove at 0.2 %, it says 19 and 11 %, and 26 and 12 % do.
        """
        most = 0 if self.method == "anytime" else self.events
        law = scipy.stats.betabinom(self.more, self.events + 0.5, self.drives - self.events + 0.5)
        return 1.0 if self.reached else float(law.cdf(most))

    @property
    def sentence(self) -> str:
        """What is proved; and if that is not what was asked, what would, and how likely that is."""
        proved = (
            f"With {percent(self.confidence, 10)} confidence at most {at_most(self.bound)} of {self.unit} like these "
            f"{self.event} ({self.events:,} of {self.drives:,})"
        )
        if self.reached:
            return proved
        would = (
            f"{self.more:,} more, all without, would"
            if self.method == "anytime"
            else f"with as many in {self.more:,} new ones, a number fixed beforehand, it would be"
        )
        return f"{proved}; {at_most(self.asked)} is not proved: {would} (a chance of {_about(self.chance)})"


def _about(chance: float) -> str:
    return "less than 1 %" if chance < 0.01 else f"{100 * chance:.0f} %"


def limit_of(hits: Bool[np.ndarray, " drives"], confidence: float, anytime: bool) -> float:
    """The smallest risk that drives, in their order, prove."""
    if anytime:
        return anytime_limit(*moments(hits), confidence)
    return rate_limit(confidence, int(hits.sum()), len(hits))
