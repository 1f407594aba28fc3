"""What a bound counts: every method sees its calibration samples as units, and what each unit asks of the thresholds.

A unit is a window, a vehicle with all its windows, or one window of a vehicle drawn at random. It asks of base j that
c_j be at most the lowest score that j had in a window of the unit that drove j, and that the tube of j reach as far as
those windows were from j. A window that leaves the cover's tube around its nearest base is missed at every threshold:
it asks with a score of −∞. A unit is missed if anything it asks for is.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.certificates.calibration import ScoredSamples, refuse_trained
from coverdrive.certificates.certificate import Certificate, Counted, Tubes, fingerprint
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


@dataclass(frozen=True)
class Units:
    """N calibration units with D demands, at most one for each unit and base."""

    unit: Int[np.ndarray, " D"]
    """in 0 … N − 1: the unit that asks"""
    base: Int[np.ndarray, " D"]
    """the base that it drove"""
    score: Float[np.ndarray, " D"]
    """lowest score of that base in the unit's windows, −∞ if it left the cover's tube in one of them"""
    distance: Float[np.ndarray, " D"]
    """largest distance from that base in the unit's windows"""
    count: int
    """number N of units"""
    kind: Counted
    """what is counted"""
    samples: ScoredSamples
    """the windows of all units"""
    tube: float
    """radius ρ of the cover"""

    def __len__(self) -> int:
        """Number N of units."""
        return self.count

    @property
    def bases(self) -> int:
        """Number M of bases."""
        return self.samples.scores.shape[1]

    @property
    def covered(self) -> Bool[np.ndarray, " N"]:
        """Units that never leave the cover's tube."""
        return np.isfinite(self.level(self.score))

    def level(self, demanded: Float[np.ndarray, " D"]) -> Float[np.ndarray, " N"]:
        """Least of one number for each demand, unit by unit."""
        least = np.full(self.count, np.inf)
        np.minimum.at(least, self.unit, demanded)
        return least

    def missed(self, rule: Thresholds) -> Bool[np.ndarray, " N"]:
        """Units that a rule misses."""
        demands = (self.score < rule.values[self.base]) | (self.distance > rule.tube[self.base])
        return np.bincount(self.unit, weights=demands, minlength=self.count) > 0

    def certificate(
        self,
        method: str,
        rule: Thresholds,
        epsilon: float,
        confidence: float | None,
        groups: int = 1,
        unseen_bases: int = 0,
        tubes: Tubes = "cover",
    ) -> Certificate:
        """The certificate of a rule that was calibrated on these units."""
        covered = self.covered
        return Certificate(
            method=method,
            epsilon=epsilon,
            confidence=confidence,
            samples=self.count,
            unit=self.kind,
            bases=self.bases,
            uncovered=int((~covered).sum()),
            unseen_bases=unseen_bases,
            discarded=int((self.missed(rule) & covered).sum()),
            tube=self.tube,
            fingerprint=fingerprint(self.samples.scores, self.samples.base, self.samples.distance),
            groups=groups,
            tubes=tubes,
        )


def calibration_units(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    unit: Counted,
    seed: int = 0,
) -> Units:
    """Calibration samples as units.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed before the calibration samples are seen.
        trained_on: keys of the vehicles that trained the network.
        unit: what the bound counts.
        seed: of the draw of one window of every vehicle.

    Raises:
        CertificateError: calibration samples trained the network.
    """
    refuse_trained(samples, trained_on)
    return make_units(samples, tube, unit, seed)


def make_units(samples: ScoredSamples, tube: float, unit: Counted, seed: int = 0) -> Units:
    """Any samples as units; arguments as in `calibration_units`."""
    if unit == "drawn window":
        samples = one_window_each(samples, seed)
    windows = np.arange(len(samples))
    number = np.unique(samples.vehicle, return_inverse=True)[1] if unit == "vehicle" else windows
    score = np.where(samples.distance <= tube, samples.score_of_base.astype(float), -np.inf)
    bases = samples.scores.shape[1]
    asked, demand = np.unique(number * bases + samples.base, return_inverse=True)
    lowest, farthest = np.full(len(asked), np.inf), np.zeros(len(asked))
    np.minimum.at(lowest, demand, score)
    np.maximum.at(farthest, demand, samples.distance)
    return Units(asked // bases, asked % bases, lowest, farthest, int(number.max()) + 1, unit, samples, tube)


def one_window_each(samples: ScoredSamples, seed: int) -> ScoredSamples:
    """One window of every vehicle, drawn with equal chances.

    Args:
        samples: windows of vehicles.
        seed: of the draw.
    """
    order = np.random.default_rng(seed).permutation(len(samples))
    _, first = np.unique(samples.vehicle[order], return_index=True)
    return samples.of(np.sort(order[first]))


def check_epsilon(epsilon: float) -> None:
    """Raise `CertificateError` unless 0 < ε < 1."""
    if not 0 < epsilon < 1:
        raise CertificateError(f"a bound ε on the probability of a miss must lie between 0 and 1, got {epsilon}")


def number_discarded(
    discarded: int | None, epsilon: float | None, allowed: Callable[[float], int], least: float, count: int
) -> int:
    """The number r of calibration units that may be missed, as given or as a bound ε allows.

    Args:
        discarded: r, if given.
        epsilon: the bound, if given.
        allowed: r for a bound; negative if the bound is impossible.
        least: the smallest bound possible.
        count: number N of calibration units.

    Raises:
        CertificateError: both or neither are given, or what is given is impossible.
    """
    if epsilon is not None and discarded is None:
        check_epsilon(epsilon)
        discarded = allowed(epsilon)
        if discarded < 0:
            raise CertificateError(
                f"{count} calibration units cannot prove ε = {epsilon:g}; the smallest ε possible with them is "
                f"{least:.3g}, so allow that much or calibrate on more data"
            )
    elif discarded is None or epsilon is not None:
        raise CertificateError("give either the number of discarded samples or a bound ε, and not both")
    if not 0 <= discarded < count:
        raise CertificateError(f"from 0 to {count - 1} of {count} calibration units can be discarded, got {discarded}")
    return discarded
