"""Risk against speed: a line for every λ, and for everybody beside, with intervals."""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import scipy
from scipy.special import betaincinv

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.drives import limit_of
from coverdrive.errors import SettingError
from coverdrive.league.entrants import Known, seated
from coverdrive.simulation.measures.notable import COLLIDED, OWN_FAULT
from coverdrive.simulation.measures.statistics import median_headway, plan_share
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.predictor import Scalable
from coverdrive.simulation.studies.comparison import mean_interval
from coverdrive.simulation.studies.setup import Setup

OURS = "default"
"""the name of our own sets"""

SCALED = "constant-velocity-box", "paper-sets"
"""names of entrants whose sets have a scale as well"""

_CONFIDENCE = 0.95
_UNLIKELY = 1e-9
"""probability of the numbers of events that are left out"""

POWER = 0.8
"""probability of telling two rates apart that differ as much as those that were seen"""


def setups_beside(
    setup: Setup, known: Known, names: Sequence[str], scales: Sequence[float]
) -> dict[tuple[str, float | None], Setup]:
    """The drives of entrants of the league in place of the default, by name and, where they have one, by scale.

    A SettingError if there is no such entrant, or if it does not take part there.
    """
    found: dict[tuple[str, float | None], Setup] = {}
    for name in names:
        other = seated(setup, name, known)
        if isinstance(other, str):
            raise SettingError(f"{name} cannot stand beside: {other}")
        belief: Any = other.predictor
        if name in SCALED:
            found |= {(name, scale): replace(other, predictor=belief.scaled(scale)) for scale in scales}
        else:
            found[name, None] = other
    return found


def frontier(
    tables: Mapping[tuple[str, str, float | None], pl.DataFrame], predictor: Scalable, anytime: bool = False
) -> pl.DataFrame:
    """A line for the drives of everybody at every λ, with 95 % intervals.

    Those of collisions are Clopper and Pearson's, for a number of drives that was fixed. A proof that may end
    ``anytime`` has from 0 to the limit that holds at any time with 95 %; the interval of its mean speed takes the
    number as fixed.

    ``headway`` [s] is kept in nine of ten moments behind somebody, in the median drive; ``claim`` is the bound ε on the
    windows of recorded traffic at that λ, 1 if nothing is proved; of others null.

    Args:
        tables: of trials, by the kind of drive, ``pilot`` or ``proof``, who drove, and λ if there is one.
        predictor: of our own sets.
        anytime: whether a proof ends when its collisions say so.
    """
    lines = list[dict[str, Any]]()
    for (kind, who, scale), trials in tables.items():
        table = trials.filter(STARTED)
        speeds = table["mean_speed"].to_numpy()
        collisions, own = (int(table.select(event.sum()).item()) for event in (COLLIDED, OWN_FAULT))
        if anytime and kind == "proof":
            hits = table.select(COLLIDED).to_series().to_numpy()
            low, high = 0.0, limit_of(hits, _CONFIDENCE, anytime)
        else:
            low, high = clopper_pearson(collisions, table.height, _CONFIDENCE)
        slow, fast = mean_interval(speeds, _CONFIDENCE)
        lines.append(
            {
                "who": who,
                "scale": scale,
                "drives_of": kind,
                "claim": predictor.scaled(scale or 0.0).certificate.epsilon if who == OURS else None,
                "drives": table.height,
                "collisions": collisions,
                "own_fault": own,
                "rate_low": low,
                "rate_high": high,
                "mean_speed": float(speeds.mean()),
                "speed_low": slow,
                "speed_high": fast,
                "share_unsafe": plan_share(table, "unsafe"),
                "headway": median_headway(table),
            }
        )
    return pl.DataFrame(lines, infer_schema_length=None)


def drives_to_tell(first: tuple[int, int], second: tuple[int, int]) -> int | None:
    """How many drives of each tell two rates apart with a probability of `POWER`, if they are as they were seen.

    It is 0 if they are told apart, and None if they were seen to be alike. Each is given by its events and drives; they
    are told apart if their exact 95 % intervals do not overlap. That is stricter than a test of two rates, so that it
    may be asked of the safest and the riskiest of several: of eight that are alike, it tells these two apart in 7 % of
    the cases at the most with 100 drives each, and in 10 % with many, where a test at 5 % does in half of them.
    """
    (low, high), (lower, upper) = (clopper_pearson(*each, _CONFIDENCE) for each in (first, second))
    if high < lower or upper < low:
        return 0
    rates = sorted(events / drives for events, drives in (first, second))
    if rates[0] == rates[1]:
        return None
    most = 1
    while told_apart(most, *rates) < POWER:
        most *= 2
    return bisect_left(range(most), POWER, key=lambda drives: told_apart(drives, *rates) if drives else 0.0)


def told_apart(drives: int, rate: float, higher: float) -> float:
    """Probability that the exact intervals of so many drives of each of two rates do not overlap, in this order."""
    binom = scipy.stats.binom
    few, many = (np.arange(*binom.interval(1 - _UNLIKELY, drives, each) + np.array([0, 1])) for each in (rate, higher))
    tail = (1 - _CONFIDENCE) / 2
    ends = np.where(few < drives, betaincinv(few + 1, np.maximum(drives - few, 1), 1 - tail), 1.0)
    begins = np.where(many > 0, betaincinv(np.maximum(many, 1), drives - many + 1, tail), 0.0)
    enough = np.append(many, drives + 1)[np.searchsorted(begins, ends, side="right")]
    return float(binom.pmf(few, drives, rate) @ binom.sf(enough - 1, drives, higher))
