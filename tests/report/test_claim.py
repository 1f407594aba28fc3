"""Every kind of bound is called what it is, in words, in tables, and by its marks."""

from dataclasses import replace

import pytest
from report_fakes import make_certificate, make_compared
from rich.console import Console

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.methods import Method
from coverdrive.report.claim import legend, signs, strength, whose
from coverdrive.report.page.methods import methods_plot
from coverdrive.report.risk_figure import risk_figure
from coverdrive.report.terminal import methods_table

BASES = 5
SURE = make_certificate(BASES)
AVERAGE = replace(SURE, confidence=None)
PER_BASE, CLUSTERED = replace(SURE, groups=BASES), replace(SURE, groups=3)
AVERAGE_PER_BASE = replace(AVERAGE, groups=BASES)


@pytest.mark.parametrize(
    ("certificate", "strong", "who", "sign", "name"),
    [
        (SURE, "with 99 % confidence", "vehicles", "", "nested-sets"),
        (
            AVERAGE,
            "on average over calibrations, without confidence",
            "vehicles",
            "†",
            "nested-sets (on average)",
        ),
        (
            PER_BASE,
            "with 99 % confidence",
            "the vehicles that drive a base, for each base by itself",
            "‡",
            "nested-sets (each base)",
        ),
        (
            CLUSTERED,
            "with 99 % confidence",
            "the vehicles that drive a group of bases, for each group of bases by itself",
            "‡",
            "nested-sets (each group)",
        ),
        (
            AVERAGE_PER_BASE,
            "on average over calibrations, without confidence",
            "the vehicles that drive a base, for each base by itself",
            "†‡",
            "nested-sets (on average, each base)",
        ),
    ],
)
def test_every_kind_has_its_words(certificate: Certificate, strong: str, who: str, sign: str, name: str) -> None:
    compared = make_compared(Method.NESTED_SETS, certificate)
    assert (strength(certificate), whose(certificate), signs(certificate)) == (strong, who, sign)
    assert legend([compared]) == name
    bounds, observed = methods_plot([compared]).figure.data
    assert bounds.name == name
    assert bounds.customdata[0] == f"at most 14.4 % of {who} missed,<br>{strong}"
    assert ("-open" in bounds.marker.symbol[0], "-dot" in bounds.marker.symbol[0]) == ("†" in sign, "‡" in sign)
    assert observed.customdata[0] == "4 % missed on unseen scenes (4 of 100)"
    console = Console(width=80)
    with console.capture() as capture:
        console.print(methods_table([compared]))
    (row,) = (line for line in capture.get().splitlines() if line.startswith("nested-sets"))
    assert f"14.4 %{sign}" in row and "proved" not in capture.get()
    axes = risk_figure([compared]).axes[0]
    (line,) = (line for line in axes.lines if line.get_label() == name)
    assert (line.get_markerfacecolor() == "#FFFFFF") == ("†" in sign)
    assert len([line for line in axes.lines if line.get_marker() == "."]) == ("‡" in sign)


def test_the_axis_is_cut_for_a_bound_far_beyond_what_was_asked_for() -> None:
    shown = [
        make_compared(Method.NESTED_SETS, replace(SURE, epsilon=0.1), target=0.1),
        make_compared(Method.SVM, replace(SURE, epsilon=0.53)),
    ]
    figure = methods_plot(shown).figure
    assert list(figure.layout.xaxis.range) == [0, pytest.approx(15)]
    far = figure.data[2]
    assert (far.x[0], far.marker.symbol[0], far.text[0]) == (pytest.approx(15), "triangle-right", "bound 53 % ")
    assert figure.data[0].text[0] == ""
    axes = risk_figure(shown).axes[0]
    assert axes.get_xlim() == (0, pytest.approx(15))
    assert "bound 53 %" in [text.get_text() for text in axes.texts]
    assert list(methods_plot(shown[1:]).figure.layout.xaxis.range)[1] > 53  # nothing was asked for
