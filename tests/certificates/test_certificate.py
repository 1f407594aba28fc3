"""The sentence says what is proved, no more: its unit, its confidence or lack of one, and what it leaves out."""

from dataclasses import replace

import pytest

from coverdrive.certificates.certificate import Certificate, Unit

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
        "window is at most 1.23 % (post-bloating, 1,000 calibration windows, 3 of them uncovered, 17 bases), if new "
        "windows are independent draws from the same traffic as the calibration windows."
    )


@pytest.mark.parametrize(
    ("unit", "groups", "miss"),
    [
        ("vehicle", 1, "a vehicle leaves its predicted set in any window in which it is seen is"),
        ("window", 17, "within the horizon of one window, whichever calibrated base it drives there, is"),
        (
            "vehicle",
            17,
            "a vehicle that drives a calibrated base leaves its predicted set in any window in which it does, for "
            "every such base, is",
        ),
    ],
)
def test_what_is_counted(unit: Unit, groups: int, miss: str) -> None:
    assert f"{miss} at most 1.23 %" in replace(PLAIN, unit=unit, groups=groups).sentence


def test_a_marginal_certificate_claims_no_confidence() -> None:
    sentence = replace(PLAIN, confidence=None).sentence
    assert sentence.startswith("Over calibration and test together, the probability that")
    assert sentence.endswith("where some calibrations are refused, on average.")
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


def test_vehicles_and_scene_groups_are_counted_and_what_they_mean_is_said() -> None:
    several = replace(PLAIN, vehicles=90, scenes=4, design_effect=2.345)
    assert "1,000 calibration windows of 90 vehicles in 4 scene groups, 3 of them uncovered" in several.sentence
    assert "each has 11: the bound can be far too small; claim a share of windows instead." in several.sentence
    assert "of groups there are only 4 (design effect 2.3)." in several.sentence
    alone = replace(PLAIN, unit="vehicle", samples=90, vehicles=90, scenes=1).sentence
    assert "90 calibration vehicles in 1 scene group, 3 of them uncovered" in alone
    assert "of groups there is only one, which does not show how much groups differ." in alone
    many = replace(PLAIN, unit="vehicle", samples=90, vehicles=90, scenes=40, design_effect=1.0).sentence
    assert many.endswith("as the calibration vehicles.")
    alike = replace(PLAIN, unit="share", samples=90, vehicles=90, scenes=40, design_effect=6.5)
    assert "are alike (design effect 6.5), not independent: the bound can be too small" in alike.sentence
    assert "alike" not in replace(alike, unit="group").sentence


def test_shares_and_groups_are_told_apart() -> None:
    share = replace(PLAIN, unit="share", vehicles=1000, scenes=50).sentence
    assert "the expected share of a vehicle's windows in which it leaves its predicted set is at most 1.23 %" in share
    assert "1,000 calibration vehicles in 50 scene groups, 3 of them with uncovered windows" in share
    assert "uncovered" not in replace(PLAIN, unit="share", uncovered=0).sentence
    group = replace(PLAIN, unit="group", samples=50, vehicles=1000, scenes=50).sentence
    assert "a vehicle of a new scene group leaves its predicted set in any window in which it is seen is" in group
    assert "50 calibration scene groups of 1,000 vehicles" in group
