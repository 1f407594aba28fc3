"""Risk against set size: what every method of calibration bounds, what was observed, and what it costs."""

from collections.abc import Sequence
from typing import Any

from coverdrive.certificates.comparison import Compared
from coverdrive.errors import DataError
from coverdrive.percentages import at_most, percent
from coverdrive.reporting.claim import legend, strength, whose
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Figure, Mark, Panel, Points, Texts

_LARGE, _SMALL = 7.0, 3.5
"""[point] marks of bounds, and of what was observed"""
_BEYOND = 1.5
"""times the largest ε that was asked for, to which the axis reaches"""
_MARGIN = 1.06
"""from the largest bound to the end of an axis that is not cut"""
_CAPTION = (
    "Every method of calibration on the same scores. Large marks are bounds: filled, with confidence; hollow, only on "
    "average over calibrations, so that this one may miss more; with a dot, for each base by itself, "
    "so that more of all {unit}s may be missed. Small marks: what was missed on scenes that did not train it, with its "
    "95 % interval. "
    "Left is safer, low is more useful. What is beyond the right edge is an arrow there; an interval that reaches it "
    "goes on."
)


def risk_figure(compared: Sequence[Compared]) -> Figure:
    """The mean set size of every method, at its targets, against the bound on its miss rate and the observed one.

    Methods that refused are left out; DataError if all did.
    """
    shown = [each for each in compared if each.certificate and each.evaluation and each.missed]
    if not shown or not shown[0].certificate or not shown[0].evaluation:
        raise DataError("every method refused, so that there is nothing to draw; ask for a larger ε")
    limit, unit = _limit(shown), shown[0].certificate.unit
    methods = [method for method in type(shown[0].method) if any(each.method is method for each in shown)]
    marks: list[Mark] = []
    for number, method in enumerate(methods):
        mine = [each for each in shown if each.method is method]
        look = {"colour": style.CYCLE[number % len(style.CYCLE)], "name": legend(mine)}
        for each in mine:
            marks += _marks(each, style.MARKERS[number % len(style.MARKERS)], limit, look)
    noun = {"share": "window", "group": "vehicle"}.get(unit, unit)
    x = Axis(f"missed {noun}s [%]", 0, limit)
    y = Axis(f"mean set size [{'base trajectories' if shown[0].evaluation.mean_area is None else 'm²'}]")
    return Figure([[Panel(marks, x, y)]], height=4.2, caption=_CAPTION.format(unit=noun), legend_columns=3)


def _limit(compared: Sequence[Compared]) -> float:
    """End of the axis of miss rates [%], cut where it would squeeze all other methods for the sake of a single one."""
    rates = [each.certificate.epsilon for each in compared if each.certificate]
    rates += [each.missed.value for each in compared if each.missed]
    targets = [100 * each.target for each in compared if each.target is not None]
    largest = _MARGIN * max(100 * rate for rate in rates)
    return min(largest, _BEYOND * max(targets)) if targets else largest


def _marks(each: Compared, marker: str, limit: float, look: dict[str, Any]) -> list[Mark]:
    """A bound as a large mark, the observed rate as a small one with interval; arrows at the edge."""
    certificate, evaluation, missed = each.certificate, each.evaluation, each.missed
    assert certificate and evaluation and missed
    bound, observed, size = 100 * certificate.epsilon, 100 * missed.value, [evaluation.size]
    hollow, hover = certificate.confidence is None, f"{each.method.value}\n{{}}\nset size {evaluation.sized}"

    def point(value: float, said: str, **more: Any) -> Points:
        shown = ">" if value > limit else marker
        return Points(x=[min(value, limit)], y=size, marker=shown, hover=[hover.format(said)], **look, **more)

    said = f"at most {at_most(certificate.epsilon, 3)} of {whose(certificate)} missed,\n{strength(certificate)}"
    marks: list[Mark] = [point(bound, said, size=_LARGE, hollow=hollow)]
    if bound > limit:
        beyond = {"bound": certificate.epsilon, "observed": missed.value}
        text = ", ".join(f"{name} {percent(value, 2)}" for name, value in beyond.items() if 100 * value > limit)
        marks.append(Texts(x=[limit], y=size, text=[text], anchor="end", above=4, **look))
    elif certificate.groups > 1:
        dot: dict[str, Any] = look if hollow else look | {"colour": style.PAPER}
        marks.append(Points(x=[bound], y=size, marker=".", size=3, **dot))
    said = f"{percent(missed.value)} missed on scenes that did not train it ({missed.counts})"
    low, high = ([min(100 * end, limit)] for end in (missed.low, missed.high))
    return [*marks, point(observed, said, low=low, high=high, along="x", size=_SMALL)]
