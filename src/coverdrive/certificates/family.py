"""A one-parameter family of thresholds, and of tubes: its shape is fixed on training data, one number is calibrated.

The rules of the family are nested: rule l = 0 calls every base possible, and every next rule has thresholds that are
at least as high, and tubes that are no wider. A calibration unit that is missed by a rule is missed by all later ones.
The last rule that misses at most r of N₂ units has a miss probability V with P{V > ε} ≤ Φ(ε, r, N₂): the order
statistic of one number has that law, and no binomial factor is needed, because there is one way to discard the r
lowest. For M bases this is a far smaller bound than post-bloating's, paid in larger sets where the shape is wrong.
Units that leave the cover's tube are missed by every rule.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted, Tubes
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.units import Units, calibration_units, number_discarded
from coverdrive.errors import CertificateError


@dataclass(frozen=True)
class Family:
    """Nested rules, checked when made."""

    values: Float[np.ndarray, "L M"]
    """thresholds of every rule, from 0 upwards, not falling from one rule to the next"""
    radii: Float[np.ndarray, "L M"] | None = None
    """of the tubes of every rule, not growing from one rule to the next; without them, the tube of the cover"""

    def __post_init__(self) -> None:
        """Refuse a family in which a missed sample might not stay missed."""
        if len(self.values) == 0 or (self.values[0] != 0).any() or not (np.diff(self.values, axis=0) >= 0).all():
            raise CertificateError("a family of thresholds must start with zeros and must not fall from rule to rule")
        if self.radii is not None and not (np.diff(self.radii, axis=0) <= 0).all():
            raise CertificateError("the tubes of a family of rules must not grow from rule to rule")

    @property
    def tubes(self) -> Tubes:
        """Whether every base has a tube of its own."""
        return "cover" if self.radii is None else "per base"

    def rule(self, number: int, tube: float) -> Thresholds:
        """One rule of the family; ``tube`` is the radius ρ of the cover."""
        return Thresholds.at(self.values[number], tube if self.radii is None else np.minimum(self.radii[number], tube))

    def last_passed(self, units: Units) -> Int[np.ndarray, " N"]:
        """For every unit the last rule that does not miss it; −1 if all do."""
        rules = np.empty(len(units.score))
        for base in range(units.bases):
            asks = units.base == base
            rules[asks] = np.searchsorted(self.values[:, base], units.score[asks], side="right") - 1
            if self.radii is not None:
                reached = np.searchsorted(-self.radii[:, base], -units.distance[asks], side="right") - 1
                rules[asks] = np.minimum(rules[asks], reached)
        return units.level(rules).astype(np.int64)


def quantile_family(training: ScoredSamples, rules: int = 400, tube: float | None = None) -> Family:
    """Thresholds at equal quantiles of every base's training scores, after proportional ones up to the lowest score.

    With tubes, the radius of every base is the quantile of its training distances that is passed as often, after
    proportional ones down to the largest distance. A base without training samples is always possible, within the
    widest tube.

    Args:
        training: scores of the training split Ω₁.
        rules: number L ≥ 2 of rules; half of them up to the lowest score of every base, half above, where the
            quantiles are spaced geometrically.
        tube: radius ρ of the cover, the widest of all tubes; if not given, no tube is shaped.
    """
    bases = training.scores.shape[1]
    half = rules // 2
    values = np.zeros((2 * half, bases))
    radii = np.full((2 * half, bases), np.inf if tube is None else tube)
    levels = np.geomspace(1 / len(training), 1, half)
    for base in np.unique(training.base):
        scores = training.score_of_base[training.base == base]
        values[:half, base] = np.linspace(0, scores.min(), half, endpoint=False)
        values[half:, base] = np.quantile(scores, levels)
        if tube is not None:
            distances = np.minimum(training.distance[training.base == base], tube)
            radii[:half, base] = np.linspace(tube, distances.max(), half, endpoint=False)
            radii[half:, base] = np.quantile(distances, 1 - levels)
    shaped = None if tube is None else np.minimum.accumulate(radii, axis=0)
    return Family(np.maximum.accumulate(values, axis=0), shaped)


def calibrate_family(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    family: Family,
    discarded: int | None = None,
    epsilon: float | None = None,
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
) -> tuple[Thresholds, Certificate]:
    """The last rule of the family that misses at most r calibration units, and the bound on missing a new one.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed beforehand.
        trained_on: keys of the vehicles that trained the network or shaped the family.
        family: of nested rules, fixed beforehand.
        discarded: number r ≥ 0 of units that may be missed, fixed beforehand. Give this, or ``epsilon``.
        epsilon: the bound; r is the greatest number that stays within it.
        confidence: of the bound, in (0, 1).
        unit: what the bound counts.
        seed: of the draw of one window of every vehicle, where these are the unit.

    Raises:
        CertificateError: calibration samples trained the network, there are too few of them, or more than r of them
            leave the tube.
    """
    units = calibration_units(samples, tube, trained_on, unit, seed)
    count = len(units)
    least = rate_limit(confidence, 0, count)
    allowed = number_discarded(discarded, epsilon, lambda bound: misses_allowed(bound, confidence, count), least, count)
    last = np.sort(family.last_passed(units))
    chosen = int(last[allowed])
    if chosen < 0:
        raise CertificateError(
            f"{int((last < 0).sum())} of {count} calibration {unit}s leave the tube around their base, but only "
            f"{allowed} may be missed; allow more, or widen the tube or refine the basis"
        )
    rule = family.rule(chosen, tube)
    bound = rate_limit(confidence, allowed, count)
    never = int((family.values[-1] == 0).sum())
    kind = "thresholds" if family.radii is None else "thresholds and tubes"
    return rule, units.certificate(
        f"one-parameter family of {kind}", rule, bound, confidence, unseen_bases=never, tubes=family.tubes
    )
