"""Risk against set size of all methods."""

from dataclasses import replace

import pytest
from report_fakes import make_certificate, make_compared

from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.methods import Method
from coverdrive.errors import DataError
from coverdrive.report.risk_figure import risk_figure


def compared(method: Method, epsilon: float, size: float) -> Compared:
    return make_compared(method, replace(make_certificate(17), epsilon=epsilon), epsilon, size)


REFUSED = Compared(Method.NESTED_SETS, 0.01, None, None, "too few", 0.0)


def test_every_method_that_did_not_refuse_is_shown() -> None:
    shown = [compared(Method.PAC_POOLED, 0.05, 6.0), compared(Method.PAC_POOLED, 0.1, 4.0)]
    figure = risk_figure([compared(Method.POST_BLOATING, 0.08, 9.0), REFUSED, *shown])
    (axes,) = figure.axes
    assert axes.get_legend_handles_labels()[1] == ["post-bloating", "pac-pooled"]
    marks = [line for line in axes.lines if line.get_marker() not in ("None", None) and len(line.get_xydata())]
    large = [line.get_xydata().tolist() for line in marks if line.get_markersize() > 6]
    small = [line.get_xydata().tolist() for line in marks if line.get_markersize() < 6]
    assert large == [[[8.0, 9.0]], [[5.0, 6.0]], [[10.0, 4.0]]]
    assert small == [[[4.0, 9.0]], [[4.0, 6.0]], [[4.0, 4.0]]]
    assert axes.get_xlabel() == "missed vehicles [%]"


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(DataError, match="every method refused"):
        risk_figure([REFUSED])
