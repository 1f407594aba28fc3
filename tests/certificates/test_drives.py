"""Risks from counts of drives: by hand, against binomial limits, and at any time never sooner than beforehand."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from coverdrive.certificates.bounds import clopper_pearson, misses_allowed, rate_limit
from coverdrive.certificates.drives import (
    Procedure,
    Proof,
    anytime_limit,
    drives_needed,
    holm,
    limit_of,
    log_evidence,
    moments,
    p_value,
    pilot_order,
    proved_at,
)
from coverdrive.errors import CertificateError

RISKS = st.floats(0.001, 0.5)
SERIES = st.lists(st.booleans(), max_size=60).map(lambda hits: np.array(hits, dtype=bool))


def proof(bound: float, method: Procedure = "anytime", events: int = 0, drives: int = 2301) -> Proof:
    return Proof("touch anybody", events, drives, 0.002, bound, 0.99, method, "20-s drives")


def test_drives_needed_by_hand() -> None:
    """Without any event, (1 − r)^n is to be at most 1 − confidence."""
    assert drives_needed(0, 0.002, 0.99) == 2301 == math.ceil(math.log(0.01) / math.log(0.998))
    assert drives_needed(0, 0.01, 0.99) == 459
    assert drives_needed(1, 0.5, 0.9) == 7  # 8 / 128 is at most 1/10, and 7 / 64 is not
    with pytest.raises(CertificateError, match="confidence must lie strictly between 0 and 1, got 1"):
        drives_needed(0, 0.1, 1.0)


@given(st.integers(0, 8), st.floats(0.01, 0.5), st.floats(0.51, 0.999))
def test_the_fewest_drives_are_the_fewest(events: int, risk: float, confidence: float) -> None:
    fewest = drives_needed(events, risk, confidence)
    assert misses_allowed(risk, confidence, fewest) == events
    assert misses_allowed(risk, confidence, fewest - 1) == events - 1
    assert rate_limit(confidence, events, fewest) <= risk * (1 + 1e-9)
    assert clopper_pearson(events, fewest, 2 * confidence - 1)[1] <= risk * (1 + 1e-9)
    sooner = drives_needed(events, risk, confidence, anytime=True) - 1
    assert fewest <= sooner + 1
    assert p_value(events, sooner, risk, anytime=True) > 1 - confidence


def test_the_price_of_stopping_at_any_time() -> None:
    """The table of the module."""
    events = [0, 1, 2, 3, 4, 5, 10, 20]
    fixed = [drives_needed(count, 0.002, 0.99) for count in events]
    anytime = [drives_needed(count, 0.002, 0.99, anytime=True) for count in events]
    assert fixed == [2301, 3317, 4200, 5020, 5799, 6551, 10068, 16546]
    assert anytime == [2593, 4394, 5380, 6360, 7333, 8295, 12869, 20698]


def test_evidence_by_hand() -> None:
    """Of one drive at a risk of 1/2, rates of 0, 0.1, 0.2, 0.3 and 0.4 are 2, 1.8, … times as good at avoiding it."""
    without = 0.4 * 2 + 0.4 * 1.8 + 0.1 * 1.6 + 0.05 * 1.4 + 0.05 * 1.2
    hit = 0.4 * 0.2 + 0.1 * 0.4 + 0.05 * 0.6 + 0.05 * 0.8
    assert np.exp(log_evidence(0, 1, 0.5)) == pytest.approx(without)
    assert np.exp(log_evidence(1, 1, 0.5)) == pytest.approx(hit)
    assert without + hit == pytest.approx(2)  # each has a probability of 1/2: what is expected is 1
    assert log_evidence(0, 0, 0.5) == pytest.approx(0)


@given(st.integers(0, 5), RISKS, RISKS)
def test_evidence_is_not_expected_to_grow_at_any_larger_rate(drives: int, one: float, other: float) -> None:
    risk, rate = sorted([one, other])
    counts = np.arange(drives + 1)
    evidence = np.exp(log_evidence(counts, np.full(drives + 1, drives), risk))
    assert stats.binom.pmf(counts, drives, rate) @ evidence <= 1 + 1e-9
    after = [np.exp(log_evidence(counts + hit, np.full(drives + 1, drives + 1), risk)) for hit in (0, 1)]
    assert ((1 - rate) * after[0] + rate * after[1] <= evidence * (1 + 1e-9)).all()


@given(SERIES, st.floats(0.5, 0.99))
def test_the_anytime_limit_is_the_best_of_all_moments(hits: np.ndarray, confidence: float) -> None:
    limits = [anytime_limit(int(hits[:n].sum()), n, confidence) for n in range(len(hits) + 1)]
    best = limit_of(hits, confidence, anytime=True)
    assert best == pytest.approx(min(limits), abs=1e-9) == anytime_limit(*moments(hits), confidence)
    assert best >= min(limit_of(hits[:n], confidence, anytime=False) for n in range(len(hits) + 1)) - 1e-9
    if best < 1:
        assert proved_at(hits, best + 1e-9, confidence) and not proved_at(hits, best - 1e-9, confidence)


def test_nothing_is_proved_by_nothing_or_by_events_alone() -> None:
    assert anytime_limit(0, 0, 0.9) == anytime_limit(3, 3, 0.9) == 1
    assert p_value(5000, 5000, 0.1, anytime=True) == p_value(0, 0, 0.1) == 1
    with pytest.raises(CertificateError, match="confidence"):
        anytime_limit(0, 10, 0.0)


def test_what_was_proved_remains_proved() -> None:
    hits = np.r_[np.zeros(2593, dtype=bool), np.ones(7, dtype=bool)]
    assert proved_at(hits, 0.002, 0.99) and not proved_at(hits[1:], 0.002, 0.99)
    assert anytime_limit(7, 2600, 0.99) > 0.006


def test_the_pilot_orders_from_the_safest_to_the_fastest() -> None:
    rates = np.array([[0.1], [0.0], [0.0], [0.3], [0.2], [0.1]])
    speeds = np.array([22.0, 19.0, 20.0, 24.0, 21.0, 23.0])
    assert pilot_order(rates, speeds) == [1, 2, 0, 5, 3]
    assert pilot_order(rates, speeds, gain=0.06) == [1, 0, 3]
    faults = np.array([[0.1, 0.1], [0.1, 0.0], [0.1, 0.0]])
    assert pilot_order(faults, np.array([22.0, 20.0, 19.0])) == [2, 1, 0]
    assert pilot_order(np.zeros((2, 1)), np.array([20.0, 20.0])) == [0]


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 9)), min_size=1, max_size=12))
def test_the_order_is_the_pareto_front(pilots: list[tuple[int, int]]) -> None:
    rates, speeds = (np.array(column, dtype=float) for column in zip(*pilots, strict=True))
    order = pilot_order(rates[:, None], speeds)
    assert (np.diff(speeds[order]) > 0).all() and (np.diff(rates[order]) >= 0).all()
    for rate, speed in zip(rates, speeds, strict=True):
        assert ((rates[order] <= rate) & (speeds[order] >= speed)).any()


def test_holm_by_hand() -> None:
    """At β = 0.1, the levels of four are 0.025, 0.033, 0.05 and 0.1."""
    assert holm(np.array([0.04, 0.01, 0.03, 0.2]), 0.9).tolist() == [True, True, True, False]
    assert holm(np.array([0.04, 0.03, 0.03, 0.2]), 0.9).tolist() == [False] * 4
    assert holm(np.array([0.09, 0.01, 0.03, 0.049]), 0.9).tolist() == [True] * 4
    assert holm(np.array([0.06, 0.01, 0.034, 0.034]), 0.9).tolist() == [False, True, False, False]


@given(st.lists(st.floats(0, 0.1), min_size=1, max_size=8), st.floats(0.8, 0.99))
def test_holm_is_between_bonferroni_and_every_test_alone(values: list[float], confidence: float) -> None:
    p_values, level = np.array(values), 1 - confidence
    proved = holm(p_values, confidence)
    assert (proved >= (p_values <= level / len(values))).all() and (proved <= (p_values <= level)).all()


def test_sentences() -> None:
    assert (
        proof(0.002).sentence
        == "With 99 % confidence at most 0.2 % of 20-s drives like these touch anybody (0 of 2,301)"
    )
    assert proof(0.002).reached and proof(0.002).more == 0
    more = proof(0.00331234, events=2, drives=3000)
    assert more.sentence == (
        "With 99 % confidence at most 0.3313 % of 20-s drives like these touch anybody (2 of 3,000); 0.2 % is not "
        "proved: 2,380 more, all without, would (a chance of 23 %)"
    )
    assert more.more == 2380 == drives_needed(2, 0.002, 0.99, anytime=True) - 3000
    assert proof(0.003, "fixed sequence", events=2, drives=3000).sentence.endswith(
        "0.2 % is not proved: with as many in 4,200 new ones, a number fixed beforehand, it would be (a chance of 44 %)"
    )
    assert proof(0.02, events=40, drives=3000).sentence.endswith("would (a chance of less than 1 %)")
    assert proof(0.002).chance == 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("method", "drives"), [("anytime", 2600), ("named beforehand", 2301)])
def test_so_many_of_the_dials_that_failed_prove_it_with_more_as_they_say(method: Procedure, drives: int) -> None:
    """Rates are drawn from a twentieth to five times the risk; the negative control is that more drives would do."""
    random, told, came = np.random.default_rng(0), list[float](), list[bool]()
    for rate in np.repeat(np.geomspace(0.0001, 0.01, 30), 60):
        events = int(random.binomial(drives, rate))
        if p_value(events, drives, 0.002, method == "anytime") > 0.01:
            failed = proof(1.0, method, events, drives)
            told.append(failed.chance)
            came.append(bool(random.binomial(failed.more, rate) <= (0 if method == "anytime" else events)))
    assert len(told) > 1000 and abs(np.mean(told) - np.mean(came)) < 0.08 and np.mean(came) < 0.4
    order = np.argsort(told)
    assert np.mean(np.array(came)[order[:400]]) < 0.05 < 0.2 < np.mean(np.array(came)[order[-400:]])


@given(st.floats(1e-6, 1), st.floats(0.5, 0.99999))
def test_what_is_printed_is_never_below_what_is_proved(bound: float, confidence: float) -> None:
    sentence = Proof("crash", 1, 9, 0.5, bound, confidence, "Holm", "drives").sentence
    printed = re.match(r"With ([\d.]+) % confidence at most ([\d.]+) % of", sentence)
    assert printed is not None
    assert float(printed[2]) / 100 >= bound * (1 - 1e-12)
    assert float(printed[1]) / 100 <= confidence * (1 + 1e-9)
