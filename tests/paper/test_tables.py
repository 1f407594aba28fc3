"""The tables of the paper: recomputed bounds, and the experiments on samples whose outcome is known."""

from dataclasses import replace

import numpy as np
import pytest
from certificates_fakes import conformal
from scipy import stats

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.errors import CertificateError
from coverdrive.paper.tables import TABLE_1, TABLE_2, make_tables, table_1_bounds, table_1_sizes
from coverdrive.progress import heard_by, stage

BASES, TUBE = 3, 0.5


def drawn(count: int, seed: int, first: int) -> ScoredSamples:
    """Uniform scores in windows of four to a vehicle; one in a hundred leaves the tube, with a score of zero."""
    random = np.random.default_rng(seed)
    base, scores = random.integers(0, BASES, count), random.random((count, BASES))
    outside = random.random(count) < 0.01
    scores[outside] = 0
    return ScoredSamples(scores, base, np.where(outside, 1.0, 0.1), first + np.arange(count) // 4)


@pytest.fixture
def sides() -> tuple[ScoredSamples, ScoredSamples, ScoredSamples]:
    return drawn(2000, 0, 0), drawn(3000, 1, 10_000), drawn(20_000, 2, 20_000)


def test_the_paper_prints_its_99_percent_bound_only_once() -> None:
    rows = table_1_bounds()
    assert [row.printed for row in rows] == [printed for _, printed, _ in TABLE_1]
    assert rows[0].printed == pytest.approx(rows[0].theorem, abs=5e-5)
    for row in rows[1:]:
        assert row.printed == pytest.approx(row.theorem_at_90, abs=1.1e-5)
        assert row.printed < row.exact < row.theorem
    theorem = stats.beta.ppf(0.99, 19, [row.samples - 18 for row in rows])
    exact = stats.beta.ppf(0.99, 17, [row.samples - 16 for row in rows])
    assert [row.theorem for row in rows] == pytest.approx(theorem.tolist())
    assert [row.exact for row in rows] == pytest.approx(exact.tolist())
    assert rows[0].family == pytest.approx(1 - 0.01 ** (1 / 15946))


def test_sizes_are_those_of_the_paper_as_far_as_the_data_go() -> None:
    assert table_1_sizes(63786) == table_1_sizes(10**6) == [size for size, _, _ in TABLE_1]
    assert table_1_sizes(6400) == [int(6400 / 63786 * size) for size, _, _ in TABLE_1]


def test_both_experiments(sides: tuple[ScoredSamples, ScoredSamples, ScoredSamples]) -> None:
    reported: list[float] = []
    train, calibration, test = sides
    with heard_by(lambda _, share: reported.append(share)), stage("tables"):
        tables = make_tables(train, calibration, test, TUBE)
    assert reported == sorted(reported) and reported[-1] == 1
    assert tables.uncovered.total == 23_000 and tables.uncovered.value == pytest.approx(0.01, abs=0.003)
    assert tables.table_1[-1].samples == tables.calibration == int((calibration.distance <= TUBE).sum())
    sizes = [row.set_size for row in tables.table_1]
    assert sizes == sorted(sizes)  # more samples, lower thresholds
    for row in tables.table_1:
        assert row.observed.value <= row.exact < row.theorem
        assert row.observed.total == tables.test  # with a score of zero, an uncovered window would be missed
        assert row.mixed.value <= row.exact
        assert row.mixed.total == tables.calibration + tables.test - row.samples
        assert row.family_observed.value <= row.family
        assert row.vehicles >= row.samples / 4
    for row, (nominal, _, _) in zip(tables.table_2, TABLE_2, strict=True):
        assert row.nominal == nominal
    assert tables.table_2[0].per_base is not None
    assert tables.table_2[0].per_base.observed.value == pytest.approx(0.1, abs=0.02)
    assert tables.table_2[0].pac_per_base is not None and tables.table_2[0].pac_per_base.observed.value < 0.1
    assert tables.table_2[-1].pac_pooled is None
    again = make_tables(*sides, TUBE)
    assert again == tables


def test_average_residual_by_hand(sides: tuple[ScoredSamples, ScoredSamples, ScoredSamples]) -> None:
    train, calibration, test = sides
    covered = calibration.of(np.flatnonzero(calibration.distance <= TUBE))
    row = make_tables(train, calibration, test, TUBE).table_2[1]
    rule, _ = conformal(covered, TUBE, np.unique(train.vehicle), 0.01, None, True)
    share = np.bincount(covered.base, minlength=BASES) / len(covered)
    assert row.per_base is not None
    assert row.per_base.average == pytest.approx(float(share @ (1 - rule.values)))


def test_training_vehicles_are_refused(sides: tuple[ScoredSamples, ScoredSamples, ScoredSamples]) -> None:
    train, calibration, test = sides
    with pytest.raises(CertificateError, match="also trained"):
        make_tables(replace(train, vehicle=train.vehicle + 10_000), calibration, test, TUBE)
