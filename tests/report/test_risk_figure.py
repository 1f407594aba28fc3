"""Risk against set size of all methods."""

import pytest

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.certificates.methods import Method
from coverdrive.errors import DataError
from coverdrive.report.risk_figure import risk_figure


def compared(method: Method, epsilon: float, size: float) -> Compared:
    certificate = Certificate(
        method=method.value, epsilon=epsilon, confidence=0.99, samples=500, unit="vehicle", bases=17, uncovered=0,
        unseen_bases=0, discarded=0, tube=0.5, fingerprint="",
    )  # fmt: skip
    evaluation = Evaluation(
        windows=Rate(5, 1000, 0.002, 0.011), vehicles=Rate(4, 100, 0.01, 0.1), not_predicted=5, outside_tube=0,
        mean_set_size=size, median_set_size=size, mean_tube=0.5, bases=17,
    )  # fmt: skip
    return Compared(method, epsilon, certificate, evaluation, "", 0.1)


REFUSED = Compared(Method.FAMILY, 0.01, None, None, "too few", 0.0)


def test_every_method_that_did_not_refuse_is_shown() -> None:
    shown = [compared(Method.PAC_POOLED, 0.05, 6.0), compared(Method.PAC_POOLED, 0.1, 4.0)]
    figure = risk_figure([compared(Method.POST_BLOATING, 0.08, 9.0), REFUSED, *shown])
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines if not str(line.get_label()).startswith("_")}
    assert list(lines) == ["post-bloating", "pac-pooled"]
    assert lines["pac-pooled"].get_xydata().tolist() == [[5.0, 6.0], [10.0, 4.0]]
    observed = [line.get_xydata().tolist() for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert observed == [[[4.0, 9.0]], [[4.0, 6.0]], [[4.0, 4.0]]]
    assert axes.get_xlabel() == "missed vehicles [%]"


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(DataError, match="every method refused"):
        risk_figure([REFUSED])
