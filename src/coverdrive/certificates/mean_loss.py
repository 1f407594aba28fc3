"""Bounds on a mean loss: the share of a vehicle's windows, or of a scene group's vehicles, that are missed.

Windows of a vehicle, and vehicles of a group, may depend on each other as they like: only the vehicles, or the groups,
have to be independent. Of n units, unit i has the loss L_i in [0, 1], and the mean of a new one is to be at most ε.

With a confidence, a bettor who starts with 1 stakes λ_i on every unit, so that its capital is Π (1 + λ_i (ε − L_i)).
If the mean were at least ε, that capital would be expected to be at most 1: it is an e-value. The stakes are the
predictable plug-in of Waudby-Smith and Ramdas (2024, §4.2), made from the units before, so that the capital depends on
the order in which units come, which means nothing. It is therefore averaged over many orders that are drawn without
looking at the losses (`orders`): a mean of e-values is one, and that it reaches 1 / (1 − confidence) has at most the
probability 1 − confidence (Markov). Losses are sorted before, so that the same losses prove the same, however they are
stored. Bounds that need no order were larger in simulation: mixtures of fixed stakes, and, where units lose shares,
Hoeffding's and Bentkus'. Without a confidence, (Σ L_i + 1) / (n + 1) ≤ ε (conformal risk control, Angelopoulos et al.
2024; for groups, hierarchical conformal prediction, Lee, Barber and Willett 2023).

Rules are nested, so that losses only grow from one to the next: the last one before the first that does not pass is
valid, wherever the rules to try are (Bates et al. 2021, Theorem 1).
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.errors import CertificateError

_STAKE = 0.99
"""the largest share of the capital that a unit can cost"""

_EXACT = 1e-6
"""within which a smallest bound is found"""

_MOST = 100_000
"""units that are looked at for how many would do"""

_ORDERS, _FEWEST, _BETS = 100, 10, 20_000
"""orders of the units over which capital is averaged; fewer where there would be more bets: with many units, the order
hardly matters"""


def proves(losses: Float[np.ndarray, " n"], epsilon: float, confidence: float | None) -> bool:
    """Whether losses prove that their mean is at most ε; the larger ε, the sooner."""
    return _proof(losses, confidence)(epsilon)


def _proof(losses: Float[np.ndarray, " n"], confidence: float | None) -> Callable[[float], bool]:
    """`proves` of the same losses, for any ε."""
    count = len(losses)
    if confidence is None:
        mean = (losses.sum() + 1) / (count + 1)
        return lambda epsilon: bool(mean <= epsilon)
    goal = -np.log1p(-confidence)
    ordered = np.sort(losses)
    turned = ordered[orders(count) if count and ordered[0] < ordered[-1] else np.arange(count)[:, None]]
    wanted = stakes(turned, goal)

    def proved(epsilon: float) -> bool:
        capital = log_capital(turned, wanted, epsilon)
        return bool(np.logaddexp.reduce(capital) - np.log(len(capital)) >= goal)

    return proved


def stakes(losses: Float[np.ndarray, "n K"], goal: float) -> Float[np.ndarray, "n K"]:
    """What a bettor wants to stake on each loss, after those before it in each of K orders, to reach ``goal``."""
    count = len(losses)
    number = np.arange(1, count + 1)[:, None]
    mean = (0.5 + np.cumsum(losses, 0)) / (number + 1)
    spread = (0.25 + np.cumsum((losses - mean) ** 2, 0)) / (number + 1)
    known = np.concatenate([np.full_like(losses[:1], 0.25), spread[:-1]])
    return np.sqrt(2 * goal / (count * known))


def log_capital(
    losses: Float[np.ndarray, "n K"], stakes: Float[np.ndarray, "n K"], epsilon: float
) -> Float[np.ndarray, " K"]:
    """Logarithm of what a bettor has in the end who stakes so much, or what can be lost at the most, in each order."""
    return np.log1p(np.minimum(stakes, _STAKE / (1 - epsilon)) * (epsilon - losses)).sum(0)


@lru_cache(maxsize=8)
def orders(count: int) -> Int[np.ndarray, "n K"]:
    """K orders of n units, the same for every n; fewer of very many units."""
    number = min(_ORDERS, max(_BETS // count, _FEWEST))
    return np.random.default_rng(count).permuted(np.tile(np.arange(count), (number, 1)), axis=1).T


def loss_limit(losses: Float[np.ndarray, " n"], confidence: float | None) -> float:
    """The smallest bound on the mean that losses prove; 1 if they prove none."""
    low, high, proved = 0.0, 1.0, _proof(losses, confidence)
    while high - low > _EXACT:
        middle = (low + high) / 2
        low, high = (low, middle) if proved(middle) else (middle, high)
    return high


def units_needed(epsilon: float, confidence: float | None) -> int:
    """How many units without any loss prove ε."""
    return next((n for n in range(1, _MOST) if proves(np.zeros(n), epsilon, confidence)), _MOST)


def last_level(calibration: Calibration, claim: Claim, level: Float[np.ndarray, " P"]) -> float:
    """The highest level of nested rules of which the mean loss is proved to be at most ε, else `CertificateError`.

    A rule misses the pieces (`Calibration.pieces`) whose level is below its own; every rule misses those of level −∞.
    """
    count, owner = len(calibration), calibration.pieces[1]
    weight = 1 / np.bincount(owner)[owner]
    order = np.argsort(level, kind="stable")
    values, first = np.unique(level[order], return_index=True)
    losses, reached = np.zeros(count), -np.inf
    for value, here in zip(values, np.split(order, first[1:]), strict=True):
        if np.isfinite(value):
            if not proves(losses, claim.bound, claim.confidence):
                break
            reached = float(value)
        np.add.at(losses, owner[here], weight[here])
    if not np.isfinite(reached):
        raise CertificateError(_refusal(calibration, claim, losses))
    return reached


def _refusal(calibration: Calibration, claim: Claim, losses: Float[np.ndarray, " n"]) -> str:
    asked = f"{len(losses)} calibration {calibration.noun}s cannot prove ε = {claim.bound:g}"
    needed = units_needed(claim.bound, claim.confidence)
    if needed > len(losses):
        least = loss_limit(np.zeros(len(losses)), claim.confidence)
        smallest = f"the smallest ε possible with them is {least:.3g}" if least < 1 else "they prove no ε"
        return f"{asked}; {smallest}, and {needed} of them would do: give more recordings, or allow a larger ε"
    return f"{asked}: {losses.mean():.3g} of them is lost with the widest sets; allow a larger ε, or widen the tube"
