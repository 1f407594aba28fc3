"""Methods called with samples and numbers in one line each, for many small cases."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coverdrive.certificates import bloating, discarding, methods
from coverdrive.certificates import conformal as regression
from coverdrive.certificates import nested_sets as nesting
from coverdrive.certificates import support_vectors as vectors
from coverdrive.certificates.bounds import binomial_tail, discarding_bound, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.drives import fixed_sequence
from coverdrive.certificates.mean_loss import proves
from coverdrive.certificates.rule import Thresholds

TINY = 1e-9
NOBODY = np.array([], dtype=np.int64)


@dataclass(frozen=True)
class Task:
    """Calibration samples, and what is claimed about them."""

    samples: ScoredSamples
    tube: float
    trained_on: np.ndarray
    epsilon: float | None = None
    confidence: float = 0.99
    unit: Unit = "window"
    training: ScoredSamples | None = None
    seed: int = 0

    @property
    def calibration(self) -> Calibration:
        return Calibration.of(self.samples, self.tube, self.trained_on, self.unit, self.seed, self.training)

    @property
    def claim(self) -> Claim:
        return Claim(self.epsilon, self.confidence)


def certify(method, task: Task):
    return methods.certify(method, task.calibration, task.claim)


def make_units(samples, tube, unit) -> Calibration:
    return Calibration.of(samples, tube, NOBODY, unit)


def post_bloat(samples, tube, trained_on, confidence=0.99, unit="window", seed=0):
    calibration = Calibration.of(samples, tube, trained_on, unit, seed)
    return bloating.post_bloat(calibration, Claim(None, confidence))


def discard(samples, tube, trained_on, discarded=None, epsilon=None, confidence=0.99, unit="window", seed=0):
    """For a bound ε, or for the one that so many discarded units have."""
    calibration = Calibration.of(samples, tube, trained_on, unit, seed)
    if discarded is not None:
        epsilon = discarding_bound(confidence, calibration.bases, discarded, len(calibration)) + TINY
    return discarding.discard(calibration, Claim(epsilon, confidence))


def nested_sets(
    samples, tube, trained_on, nested, discarded=None, epsilon=None, confidence=0.99, unit="window", seed=0
):
    """The same."""
    calibration = Calibration.of(samples, tube, trained_on, unit, seed)
    if discarded is not None:
        epsilon = rate_limit(confidence, discarded, len(calibration)) + TINY
    return nesting.nested_sets(calibration, Claim(epsilon, confidence), nested)


def losses(calibration: Calibration, rule: Thresholds) -> np.ndarray:
    """Share of the pieces of every unit of a mean loss that a rule misses."""
    parts, owner = calibration.pieces
    return np.bincount(owner, parts.missed(rule)) / np.bincount(owner)


def learn_then_test(calibration: Calibration, claim: Claim, rules: Sequence[Thresholds]) -> Thresholds | None:
    """The oracle of nested sets (Angelopoulos et al. 2021): the last rule before the first that fails its own test."""

    def passes(rule: Thresholds) -> bool:
        if calibration.kind in ("share", "group"):
            return proves(losses(calibration, rule), claim.bound, claim.sure)
        return binomial_tail(claim.bound, int(calibration.missed(rule).sum()), len(calibration)) <= 1 - claim.sure

    number = fixed_sequence(map(passes, rules))
    return rules[number - 1] if number else None


def conformal(samples, tube, trained_on, epsilon, confidence=None, per_base=False, unit="window", seed=0):
    calibration = Calibration.of(samples, tube, trained_on, unit, seed)
    return regression.conformal(calibration, Claim(epsilon, confidence), per_base)


def support_vectors(samples, tube, trained_on, training, confidence=0.99, unit="window", seed=0):
    calibration = replace(Calibration.of(samples, tube, trained_on, unit, seed), training=training)
    return vectors.support_vectors(calibration, Claim(None, confidence))
