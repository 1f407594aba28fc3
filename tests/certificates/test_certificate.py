"""The sentence says what is proved, no more: its unit, its confidence or lack of one, and what it leaves out."""

from dataclasses import replace

import pytest

from coverdrive.certificates.certificate import Certificate, Counted

PLAIN = Certificate(
    method="post-bloating",
    epsilon=0.0123,
    confidence=0.99,
    samples=1000,
    unit="window",
    bases=17,
    uncovered=3,
    unseen_bases=0,
    discarded=0,
    tube=0.75,
    fingerprint="",
)


def test_the_whole_sentence() -> None:
    assert PLAIN.sentence == (
        "With 99 % confidence, the probability that a vehicle leaves its predicted set within the horizon of one "
        "window is at most 1.23 % (post-bloating, 1000 calibration windows, 3 of them uncovered, 17 bases), if new "
        "windows are independent draws from the same traffic as the calibration windows."
    )


@pytest.mark.parametrize(
    ("unit", "groups", "miss"),
    [
        ("vehicle", 1, "a vehicle leaves its predicted set in any window in which it is seen is"),
        ("drawn window", 1, "a vehicle leaves its predicted set in one window drawn at random from its own is"),
        ("window", 17, "within the horizon of one window, whichever calibrated base it drives there, is"),
        ("window", 5, "within the horizon of one window, whichever calibrated group of bases it drives there, is"),
        (
            "vehicle",
            17,
            "a vehicle that drives a calibrated base leaves its predicted set in any window in which it does, for "
            "every such base, is",
        ),
    ],
)
def test_what_is_counted(unit: Counted, groups: int, miss: str) -> None:
    assert f"{miss} at most 1.23 %" in replace(PLAIN, unit=unit, groups=groups).sentence


def test_a_marginal_certificate_claims_no_confidence() -> None:
    sentence = replace(PLAIN, confidence=None).sentence
    assert sentence.startswith("Over calibration and test together, the probability that")
    assert sentence.endswith("without confidence: the rule of this one calibration may miss more often.")
    assert "confidence, the" not in sentence


def test_bases_that_are_not_calibrated_are_named_where_the_claim_leaves_them_out() -> None:
    assert replace(PLAIN, unseen_bases=2).sentence == PLAIN.sentence
    sentence = replace(PLAIN, unseen_bases=2, groups=17).sentence
    assert "for this ε: 2. They are always possible, and nothing is proved" in sentence


def test_a_share_of_every_bases_vehicles_is_no_share_of_all_vehicles() -> None:
    warning = "a larger share of all vehicles may be missed"
    assert warning in replace(PLAIN, unit="vehicle", groups=17).sentence
    assert warning not in replace(PLAIN, unit="vehicle").sentence
    assert warning not in replace(PLAIN, groups=17).sentence
