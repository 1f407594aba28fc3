"""Risk against set size: what every method of calibration bounds, what was observed, and what it costs."""

from collections.abc import Sequence

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Rate
from coverdrive.errors import DataError
from coverdrive.numbers import at_most, percent
from coverdrive.reporting import style
from coverdrive.reporting.claim import legend, strength, whose
from coverdrive.reporting.figure import Axis, Figure, Mark, Panel, Points, Texts

_MARKERS = "osD^v*pHPXd"
_LARGE, _SMALL = 7.0, 3.5
"""[point] marks of bounds, and of what was observed"""
_BEYOND = 1.5
"""times the largest ε that was asked for, to which the axis reaches"""
_MARGIN = 1.06
"""from the largest bound to the end of an axis that is not cut"""
_CAPTION = (
    "Every method of calibration on the same scores. Large marks are bounds: filled, with confidence; hollow, only on "
    "average over calibrations, so that this one may miss more; with a dot, for each base or group of bases by itself, "
    "so that more of all {unit}s may be missed. Small marks: what was missed on unseen scenes, with its 95 % interval. "
    "Left is safer, low is more useful. An arrow at the right edge stands for what is beyond it."
)


def risk_figure(compared: Sequence[Compared]) -> Figure:
    """The mean set size of every method against the bound on its miss rate and the observed one.

    Args:
        compared: methods at their targets; those that refused are left out.

    Raises:
        DataError: every method refused.
    """
    shown = [each for each in compared if each.certificate and each.evaluation and each.missed]
    if not shown or not shown[0].certificate:
        raise DataError("every method refused, so that there is nothing to draw; ask for a larger ε")
    methods = sorted({each.method for each in shown}, key=list(type(shown[0].method)).index)
    limit, unit = risk_limit(shown), shown[0].certificate.unit
    marks = [
        mark
        for number, method in enumerate(methods)
        for mark in _marks([each for each in shown if each.method is method], number, limit)
    ]
    x, y = Axis(f"missed {unit}s [%]", 0, limit), Axis("mean set size [base trajectories]")
    return Figure([[Panel(marks, x, y)]], height=4.2, caption=_CAPTION.format(unit=unit), legend_columns=3)


def risk_limit(compared: Sequence[Compared]) -> float:
    """End of the axis of miss rates [%], cut where it would squeeze all other methods for the sake of a single one.

    Args:
        compared: methods at their targets, of which one at least did not refuse.
    """
    bounds = [100 * each.certificate.epsilon for each in compared if each.certificate]
    observed = [100 * each.missed.value for each in compared if each.missed]
    targets = [100 * each.target for each in compared if each.target is not None]
    largest = _MARGIN * max([*bounds, *observed])
    return min(largest, _BEYOND * max(targets)) if targets else largest


def beyond(each: Compared, limit: float) -> str:
    """What of a method is beyond the end of the axis [%], in words; empty if nothing is."""
    values = {"bound": each.certificate and each.certificate.epsilon, "observed": each.missed and each.missed.value}
    return ", ".join(f"{name} {percent(value, 2)}" for name, value in values.items() if value and 100 * value > limit)


def _marks(compared: Sequence[Compared], number: int, limit: float) -> list[Mark]:
    """Bounds as large marks, observed rates as small ones with intervals; what is beyond the edge as arrows."""
    marker, colour = _MARKERS[number % len(_MARKERS)], style.CYCLE[number % len(style.CYCLE)]
    name = legend(compared)
    marks: list[Mark] = []
    for each in compared:
        if each.certificate and each.evaluation and each.missed:
            size = each.evaluation.mean_set_size
            marks += _bound(each, each.certificate, size, marker, colour, name, limit)
            marks.append(_observed(each, each.missed, size, marker, colour, name, limit))
    return marks


def _bound(
    each: Compared, certificate: Certificate, size: float, marker: str, colour: str, name: str, limit: float
) -> list[Mark]:
    bound, hollow = 100 * certificate.epsilon, certificate.confidence is None
    far = bound > limit
    said = f"at most {at_most(certificate.epsilon, 3)} of {whose(certificate)} missed,\n{strength(certificate)}"
    hover = f"{each.method.value}\n{said}\n{size:.2f} possible bases"
    marks: list[Mark] = [
        Points(x=[min(bound, limit)], y=[size], marker=">" if far else marker, size=_LARGE, hollow=hollow,
               colour=colour, name=name, hover=[hover])
    ]  # fmt: skip
    if certificate.groups > 1 and not far:
        dot = colour if hollow else style.PAPER
        marks.append(Points(x=[bound], y=[size], marker=".", size=3, colour=dot, name=name))
    if far:
        text = beyond(each, limit)
        marks.append(Texts(x=[limit], y=[size], text=[text], anchor="end", above=4, colour=colour, name=name))
    return marks


def _observed(each: Compared, missed: Rate, size: float, marker: str, colour: str, name: str, limit: float) -> Mark:
    value = 100 * missed.value
    said = f"{percent(missed.value)} missed on unseen scenes ({missed.count} of {missed.total})"
    return Points(
        x=[min(value, limit)], y=[size], low=[min(100 * missed.low, limit)], high=[min(100 * missed.high, limit)],
        along="x", marker=">" if value > limit else marker, size=_SMALL, colour=colour, name=name,
        hover=[f"{each.method.value}\n{said}\n{size:.2f} possible bases"],
    )  # fmt: skip
