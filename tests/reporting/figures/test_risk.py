"""Risk against set size of all methods."""

from dataclasses import replace

import pytest
from report_fakes import make_certificate, make_compared

from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.methods import Method
from coverdrive.errors import DataError
from coverdrive.reporting.figures.risk import risk_figure


def compared(method: Method, epsilon: float, size: float) -> Compared:
    return make_compared(method, replace(make_certificate(17), epsilon=epsilon), epsilon, size)


REFUSED = Compared(Method.NESTED_SETS, 0.01, None, None, "too few", 0.0)


def test_every_method_that_did_not_refuse_is_shown() -> None:
    shown = [compared(Method.PAC_POOLED, 0.05, 6.0), compared(Method.PAC_POOLED, 0.1, 4.0)]
    figure = risk_figure([compared(Method.POST_BLOATING, 0.08, 9.0), REFUSED, *shown])
    (panel,) = figure.panels
    assert list(figure.named) == ["post-bloating", "pac-pooled"]
    sizes = sorted({points.size for points in panel.marks})
    small, large = ([[*points.x, *points.y] for points in panel.marks if points.size == size] for size in sizes)
    assert large == [[8.0, 9.0], [5.0, 6.0], [10.0, 4.0]]
    assert small == [[4.0, 9.0], [4.0, 6.0], [4.0, 4.0]]
    assert panel.x.label == "missed vehicles [%]"
    for points in panel.marks:
        if points.size == sizes[0]:
            assert (points.low, points.high, points.along) == ([1.0], [10.0], "x")


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(DataError, match="every method refused"):
        risk_figure([REFUSED])
