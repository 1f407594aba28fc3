"""Every kind of bound is called what it is, in words, in tables, and by its marks."""

from dataclasses import replace
from typing import get_args

import pytest
from report_fakes import make_certificate, make_compared, make_contents, printed

from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.methods import Method
from coverdrive.reporting.claim import legend, set_facts, signs, strength, whose
from coverdrive.reporting.figures.risk import risk_figure
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Points, Texts
from coverdrive.reporting.tables.summaries import methods_table

BASES = 5
SURE = make_certificate(BASES)
AVERAGE = replace(SURE, confidence=None)
PER_BASE = replace(SURE, groups=BASES)
AVERAGE_PER_BASE = replace(AVERAGE, groups=BASES)
CONFIDENT, WITHOUT = "with 99 % confidence", "on average over calibrations, without confidence"
EACH = "the vehicles that drive a base, for each base by itself"


@pytest.mark.parametrize(
    ("certificate", "strong", "who", "sign", "name"),
    [
        (SURE, CONFIDENT, "vehicles", "", "nested-sets"),
        (AVERAGE, WITHOUT, "vehicles", "†", "nested-sets (on average)"),
        (PER_BASE, CONFIDENT, EACH, "‡", "nested-sets (each base)"),
        (AVERAGE_PER_BASE, WITHOUT, EACH, "†‡", "nested-sets (on average, each base)"),
    ],
)
def test_every_kind_has_its_words(certificate: Certificate, strong: str, who: str, sign: str, name: str) -> None:
    compared = make_compared(Method.NESTED_SETS, certificate)
    assert (strength(certificate), whose(certificate), signs(certificate)) == (strong, who, sign)
    assert legend([compared]) == name
    figure = risk_figure([compared])
    bounds, *dots, observed = figure.panels[0].marks
    assert list(figure.named) == [bounds.name] == [name]
    assert bounds.hover == [f"nested-sets\nat most 14.4 % of {who} missed,\n{strong}\nset size 5.00 of 5"]
    assert (bounds.hollow, [dot.marker for dot in dots]) == ("†" in sign, ["."] * ("‡" in sign))
    assert all((dot.colour == style.PAPER) == (not bounds.hollow) for dot in dots)
    assert observed.hover[0].startswith("nested-sets\n4 % missed on scenes that did not train it (4 of 100)")
    text = printed(methods_table([compared]))
    (row,) = (line for line in text.splitlines() if line.startswith("nested-sets"))
    assert f"14.4 %{sign}" in row and "proved" not in text


@pytest.mark.parametrize("unit", get_args(Unit))
def test_what_a_bound_counts_stands_among_what_was_missed(unit: Unit) -> None:
    certified, found = make_contents().certified, make_compared(Method.NESTED_SETS, SURE).evaluation
    facts = [fact for _, fact in set_facts(None, found, certified.occupied, certified.uncovered, unit)]
    missed = {str(found.missed(each)) for each in get_args(Unit)}
    assert missed.intersection(facts) == {str(found.windows), str(found.vehicles), str(found.missed(unit))}


def test_the_axis_is_cut_for_a_bound_far_beyond_what_was_asked_for() -> None:
    shown = [
        make_compared(Method.NESTED_SETS, replace(SURE, epsilon=0.1), target=0.1),
        make_compared(Method.SVM, replace(SURE, epsilon=0.53)),
    ]
    (panel,) = risk_figure(shown).panels
    assert (panel.x.low, panel.x.high) == (0, pytest.approx(15))
    arrows = [mark for mark in panel.marks if isinstance(mark, Points) and mark.marker == ">"]
    assert [list(mark.x) for mark in arrows] == [[pytest.approx(15)]]
    assert [list(mark.text) for mark in panel.marks if isinstance(mark, Texts)] == [["bound 53 %"]]
    assert risk_figure(shown[1:]).panels[0].x.high > 53  # nothing was asked for
