"""Tables 1 and 2 of the paper: what is printed there, what the formulas give, and the same experiment on other samples.

Table 1 is post-bloating on calibration sets of growing size N₂, with M = 17 bases; Table 2 is split conformal
prediction for every base by itself, with 23,919 calibration samples. In both, a miss is a base that is not predicted:
the paper leaves out what no base covers, and so do these tables.

Erratum: of the bounds printed in Table 1, only the first is the 99 % bound of Theorem 1. The others are its 90 % bound.
"""

from dataclasses import dataclass

import numpy as np

from coverdrive.certificates.bloating import post_bloat
from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.conformal import conformal
from coverdrive.certificates.evaluation import Rate, evaluate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.nested_sets import nested_sets, quantile_sets
from coverdrive.errors import CertificateError
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.data.segments import SegmentSettings
from coverdrive.prediction.data.split import SplitSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.progress import done

BASES = 17
"""M of the paper"""

CONFIDENCE = 0.99
"""of Table 1"""

TABLE_1 = (
    (15946, 0.0019, 0.00093),
    (23919, 0.00103, 0.0005),
    (31893, 0.00077, 0.0005),
    (39866, 0.00062, 0.00035),
    (47839, 0.00052, 0.00032),
    (55813, 0.00044, 0.00014),
    (63786, 0.00039, 0.00016),
)
"""N₂, the printed bound ε₉₉, and the printed empirical miss rate"""

TABLE_2 = (
    (0.1, 0.0972, 0.101639),
    (0.01, 0.1491, 0.010691),
    (0.005, 0.1681, 0.005352),
    (0.003, 0.1838, 0.003266),
    (0.002, 0.1950, 0.002287),
    (0.001, 0.2172, 0.001269),
    (0.0004, 0.2442, 0.000603),
)
"""nominal ε, average d, and empirical ε as printed"""

TABLE_2_SAMPLES = 23919
"""calibration samples of Table 2"""

_ROUNDING = 1e-9
"""of a bound, by which it is taken larger so that it allows what it is the bound of"""


def paper_settings() -> PredictionSettings:
    """The paper's labels, network and loss, overlapping windows, and a calibration side as large as in its Table 1.

    At this stride, seven twentieths of the generated scenes hold more than its 63,786 calibration samples.
    """
    return PredictionSettings.paper().model_copy(
        update={
            "segments": SegmentSettings(stride=0.1),
            "split": SplitSettings(train=0.35, calibration=0.35),
            "certificate": CertificateSettings(method=Method.POST_BLOATING, unit="window"),
        }
    )


@dataclass(frozen=True)
class Bounds:
    """One row of Table 1, for N₂ ``samples``: ε₉₉ and the empirical miss rate as printed, and recomputed bounds."""

    samples: int
    printed: float
    printed_observed: float
    theorem: float
    """99 % bound of the paper's Theorem 1, Φ(ε, M + 1, N₂)"""
    theorem_at_90: float
    """its 90 % bound"""
    exact: float
    """99 % bound Φ(ε, M − 1, N₂): every sample bounds one threshold"""
    family: float
    """99 % bound Φ(ε, 0, N₂) of nested sets"""


def table_1_bounds() -> list[Bounds]:
    """The bounds of Table 1."""
    return [Bounds(samples, printed, observed, *_bounds(BASES, samples)) for samples, printed, observed in TABLE_1]


def _bounds(bases: int, samples: int) -> tuple[float, float, float, float]:
    return (
        violation_bound(CONFIDENCE, bases + 2, samples),
        violation_bound(0.9, bases + 2, samples),
        violation_bound(CONFIDENCE, bases, samples),
        rate_limit(CONFIDENCE, 0, samples),
    )


@dataclass(frozen=True)
class Growth:
    """Post-bloating and nested sets (the family) on the first N₂ calibration samples, windows of some vehicles.

    Bounds are as in `Bounds`; of test windows, the rate of those whose base is not predicted, and the mean set size.
    """

    samples: int
    vehicles: int
    theorem: float
    exact: float
    observed: Rate
    set_size: float
    mixed: Rate
    """the same where N₂ windows of both sides, drawn at random, calibrate and the others test: windows of one vehicle
    are then on both sides, and the bound is kept because they are alike"""
    family: float
    family_observed: Rate
    family_set_size: float


@dataclass(frozen=True)
class Residuals:
    """Conformal prediction by one method at one nominal ε, with what was observed as in `Growth`."""

    average: float
    """Σ pᵢ·dᵢ, with pᵢ the share of base i in the calibration samples; dᵢ = 1 where base i is always possible"""
    observed: Rate
    set_size: float


@dataclass(frozen=True)
class ConformalRow:
    """One row of Table 2: nominal ε, average d and empirical ε as printed, and by method; none where one refused.

    The paper's method is per base; pooled has one d for all bases; PAC is with 99 % confidence, for all bases at once.
    """

    nominal: float
    printed_average: float
    printed_observed: float
    per_base: Residuals | None
    pooled: Residuals | None
    pac_per_base: Residuals | None
    pac_pooled: Residuals | None


@dataclass(frozen=True)
class PaperTables:
    """Both tables on one network of M bases and the numbers of covered samples of each side."""

    bases: int
    train: int
    calibration: int
    test: int
    uncovered: Rate
    """calibration and test samples that no base covers, which are left out"""
    table_1: list[Growth]
    table_2_samples: int
    """calibration samples of Table 2"""
    table_2: list[ConformalRow]


def make_tables(
    train: ScoredSamples, calibration: ScoredSamples, test: ScoredSamples, tube: float, seed: int = 0
) -> PaperTables:
    """Repeat the experiments of both tables, on the splits that train, calibrate and test, and the ε of the cover.

    Calibration sets of growing size are the windows of one vehicle after the other in random order, so that growth
    brings new vehicles and not only more windows of the same. For comparison, windows are also dealt out at random.

    Raises:
        CertificateError: a calibration vehicle trained the network, or there are fewer calibration samples than bases.
    """
    both = _joined(calibration, test)
    uncovered = Rate.by_cluster(both.distance > tube, both.vehicle)
    train, calibration, test, mixed = (
        side.of(np.flatnonzero(side.distance <= tube)) for side in (train, calibration, test, both)
    )
    names, number = np.unique(calibration.vehicle, return_inverse=True)
    ordered = calibration.of(np.argsort(np.random.default_rng(seed).permutation(len(names))[number], kind="stable"))
    sizes = table_1_sizes(len(ordered))
    steps = len(sizes) + len(TABLE_2)
    mixed = mixed.of(np.random.default_rng(seed).permutation(len(mixed)))
    growth: list[Growth] = []
    for size in sizes:
        growth.append(_grown(train, ordered.of(np.arange(size)), test, mixed, tube))
        done(len(growth), steps)
    few = ordered.of(np.arange(min(TABLE_2_SAMPLES, len(ordered))))
    rows: list[ConformalRow] = []
    for printed in TABLE_2:
        rows.append(_conformal_row(train, few, test, tube, printed))
        done(len(growth) + len(rows), steps)
    bases = test.scores.shape[1]
    return PaperTables(bases, len(train), len(calibration), len(test), uncovered, growth, len(few), rows)


def table_1_sizes(available: int) -> list[int]:
    """The paper's numbers of calibration samples, all made smaller alike if there are not as many as in its last."""
    share = min(1.0, available / TABLE_1[-1][0])
    return [max(int(share * size), 1) for size, _, _ in TABLE_1]


def _joined(one: ScoredSamples, other: ScoredSamples) -> ScoredSamples:
    pairs = zip(*((side.scores, side.base, side.distance, side.vehicle) for side in (one, other)), strict=True)
    return ScoredSamples(*(np.concatenate(pair) for pair in pairs))


def _grown(
    train: ScoredSamples, calibration: ScoredSamples, test: ScoredSamples, mixed: ScoredSamples, tube: float
) -> Growth:
    bases, samples = test.scores.shape[1], len(calibration)
    units, claim = Calibration.of(calibration, tube, train.vehicle), Claim(confidence=CONFIDENCE)
    bloated, _ = post_bloat(units, claim)
    drawn, _ = post_bloat(Calibration.of(mixed.of(np.arange(samples)), tube, train.vehicle), claim)
    theorem, _, exact, family = _bounds(bases, samples)
    none_missed = Claim(family + _ROUNDING, CONFIDENCE)
    shaped, _ = nested_sets(units, none_missed, quantile_sets(train))
    ours, theirs = evaluate(bloated, test), evaluate(shaped, test)
    return Growth(
        samples=samples,
        vehicles=len(np.unique(calibration.vehicle)),
        theorem=theorem,
        exact=exact,
        observed=ours.windows,
        set_size=ours.mean_set_size,
        mixed=evaluate(drawn, mixed.of(np.arange(samples, len(mixed)))).windows,
        family=family,
        family_observed=theirs.windows,
        family_set_size=theirs.mean_set_size,
    )


def _conformal_row(
    train: ScoredSamples,
    calibration: ScoredSamples,
    test: ScoredSamples,
    tube: float,
    printed: tuple[float, float, float],
) -> ConformalRow:
    units = Calibration.of(calibration, tube, train.vehicle)

    def residuals(per_base: bool, confidence: float | None) -> Residuals | None:
        try:
            rule, _ = conformal(units, Claim(printed[0], confidence), per_base)
        except CertificateError:
            return None
        found = evaluate(rule, test)
        return Residuals(float((1 - rule.values[calibration.base]).mean()), found.windows, found.mean_set_size)

    return ConformalRow(*printed, *(residuals(own, sure) for sure in (None, CONFIDENCE) for own in (True, False)))
