"""Tables 1 and 2 of the paper as curves: bounds and observed misses against N₂, observed against nominal ε."""

from collections.abc import Sequence

from coverdrive.certificates.evaluation import Rate
from coverdrive.certificates.paper_tables import TABLE_1, PaperTables
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Figure, Line, Mark, Panel, Points

_METHODS = (
    ("per_base", "conformal per base", style.BLUE, "o"),
    ("pooled", "conformal pooled", style.GREEN, "s"),
    ("pac_per_base", "PAC per base", style.SKY, "^"),
    ("pac_pooled", "PAC pooled", style.PURPLE, "D"),
)


def paper_figure(tables: PaperTables) -> Figure:
    """Both tables of one network."""
    growth = Panel(_growth(tables), Axis("calibration windows N₂", low=0, ticks=_sizes(tables)),
                   Axis("missed windows [%]", log=True), "Table 1")  # fmt: skip
    conformal = Panel(_conformal(tables), Axis("nominal ε [%]", log=True), Axis("observed ε [%]", log=True), "Table 2")
    return Figure([[growth, conformal]], height=4.2, legend_columns=4)


def _sizes(tables: PaperTables) -> dict[float, str]:
    """Ticks at the numbers of samples of both, as far as they are apart."""
    sizes = sorted({row.samples for row in tables.table_1} | {size for size, _, _ in TABLE_1})
    apart = [size for size, last in zip(sizes, [0, *sizes], strict=False) if size - last > sizes[-1] / 8]
    return {float(size): f"{size:,}" for size in apart}


def _growth(tables: PaperTables) -> list[Mark]:
    rows = tables.table_1
    samples = [row.samples for row in rows]
    return [
        Line(x=samples, y=[100 * row.theorem for row in rows], colour=style.BLACK, dashed=True, name="Theorem 1, 99 %"),
        Line(x=samples, y=[100 * row.exact for row in rows], name="exact, 99 %"),
        Line(x=samples, y=[100 * row.family for row in rows], colour=style.GREEN, name="family, 99 %"),
        _rates(samples, [row.observed for row in rows], style.BLUE, "o", "observed on new vehicles"),
        _rates(samples, [row.mixed for row in rows], style.ORANGE, "^", "observed, windows mixed"),
        _rates(samples, [row.family_observed for row in rows], style.GREEN, "s", "observed, family"),
        Points(x=[size for size, _, _ in TABLE_1], y=[100 * observed for _, _, observed in TABLE_1], marker="x",
               colour=style.VERMILION, name="paper, observed"),
    ]  # fmt: skip


def _conformal(tables: PaperTables) -> list[Mark]:
    rows = tables.table_2
    nominal = [100 * row.nominal for row in rows]
    marks: list[Mark] = [Line(x=nominal, y=nominal, colour=style.GREY, dashed=True, name="observed = nominal")]
    for column, name, colour, marker in _METHODS:
        shown = [(row.nominal, getattr(row, column).observed) for row in rows if getattr(row, column) is not None]
        marks.append(_rates([100 * each for each, _ in shown], [rate for _, rate in shown], colour, marker, name))
    printed = [100 * row.printed_observed for row in rows]
    return [*marks, Points(x=nominal, y=printed, marker="x", colour=style.VERMILION, name="paper")]


def _rates(places: Sequence[float], rates: Sequence[Rate], colour: str, marker: str, name: str) -> Mark:
    """Observed rates with their intervals; rates of zero are left out of a logarithmic axis."""
    shown = [(place, rate) for place, rate in zip(places, rates, strict=True) if rate.count]
    return Points(
        x=[place for place, _ in shown], y=[100 * rate.value for _, rate in shown], colour=colour, marker=marker,
        low=[100 * rate.low for _, rate in shown], high=[100 * rate.high for _, rate in shown], hollow=True,
        name=name if shown else f"{name}: none",
        hover=[f"{name}: {100 * rate.value:.3g} % ({100 * rate.low:.2g}–{100 * rate.high:.2g} %)" for _, rate in shown],
    )  # fmt: skip
