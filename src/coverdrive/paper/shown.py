"""Tables 1 and 2 of the paper with ours beside them: for the terminal, as CSV, and as curves.

The curves are bounds and observed misses against N₂, and observed against nominal ε.
"""

from collections.abc import Sequence
from typing import Any

import polars as pl
from rich.table import Table

from coverdrive.certificates.evaluation import Rate
from coverdrive.paper.tables import BASES, TABLE_1, Bounds, PaperTables, Residuals
from coverdrive.percentages import interval, percent
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Figure, Line, Mark, Panel, Points
from coverdrive.reporting.tables.fitting import columns_table

ERRATUM = (
    "Erratum: of the bounds that the paper prints in Table 1, only the first is the 99 % bound of its Theorem 1; "
    "the other six are the 90 % bound."
)

_METHODS = (
    ("per_base", "conformal per base", style.BLUE, "o"),
    ("pooled", "conformal pooled", style.GREEN, "s"),
    ("pac_per_base", "PAC per base", style.SKY, "^"),
    ("pac_pooled", "PAC pooled", style.PURPLE, "D"),
)


def bounds_table(rows: Sequence[Bounds]) -> Table:
    """Table 1 of the paper, recomputed."""
    shown = ("printed", "theorem", "theorem_at_90", "exact", "family", "printed_observed")
    return columns_table(
        f"Table 1 of the paper (M = {BASES}): bounds on the miss rate [%]",
        ("N₂", "printed", "99 % M+1", "90 % M+1", "99 % M−1", "99 % family", "printed observed"),
        [(f"{row.samples:,}", *(f"{100 * getattr(row, bound):.4g}" for bound in shown)) for row in rows],
        f"{ERRATUM} M+1: Theorem 1; M−1: exact for M thresholds; family: one calibrated number.",
    )


def growth_table(tables: PaperTables, name: str) -> Table:
    """The experiment of Table 1 on other samples."""
    rows = [
        (
            f"{row.samples:,}", str(row.vehicles), f"{100 * row.theorem:.3f}", f"{100 * row.exact:.3f}",
            f"{100 * row.observed.value:.3f}", f"{100 * row.observed.low:.2f}–{100 * row.observed.high:.2f}",
            f"{row.set_size:.1f}", f"{100 * row.mixed.value:.3f}", f"{100 * row.family:.3f}",
            f"{100 * row.family_observed.value:.3f}", f"{row.family_set_size:.1f}",
        )
        for row in tables.table_1
    ]  # fmt: skip
    return columns_table(
        f"Table 1 repeated on {name} (M = {tables.bases}): 99 % bounds, misses [%]",
        ("N₂", "vehicles", "M+1", "M−1", "missed", "95 %", "set", "mixed", "family", "missed", "set"),
        rows,
        f"{tables.train:,} training, {tables.calibration:,} calibration and {tables.test:,} test windows that a base "
        f"covers; left out: {tables.uncovered}. Bounds take windows for independent, as the paper does; "
        "windows of one vehicle are not, so that rates observed on new vehicles, with intervals by vehicle, can exceed "
        "them. mixed: missed where windows are dealt out at random, so that each vehicle is on both sides.",
    )


def conformal_table(tables: PaperTables, name: str) -> Table:
    """Table 2 of the paper, and its experiment on other samples."""
    rows = [
        (f"{100 * row.nominal:g}", f"{row.printed_average:.4f} {100 * row.printed_observed:.3f}",
         *(_residuals(getattr(row, method)) for method, *_ in _METHODS))
        for row in tables.table_2
    ]  # fmt: skip
    return columns_table(
        f"Table 2 repeated on {name}: average d, observed ε [%] ({tables.table_2_samples:,} calibration windows)",
        ("ε", "paper", "per base", "pooled", "PAC per base", "PAC pooled"),
        rows,
        "per base: the paper's method; PAC: with 99 % confidence; –: too few samples. d = 1: always possible.",
    )


def _residuals(values: Residuals | None) -> str:
    return "–" if values is None else f"{values.average:.4f} {100 * values.observed.value:.3f}"


def growth_frame(tables: PaperTables) -> pl.DataFrame:
    """The experiment of Table 1, beside the printed rows."""
    paper = ("paper_samples", "paper_bound", "paper_observed")
    return pl.DataFrame(
        dict(zip(paper, printed, strict=True))
        | {"samples": row.samples, "vehicles": row.vehicles, "bases": tables.bases}
        | _flat(row)
        for printed, row in zip(TABLE_1, tables.table_1, strict=True)
    )


def conformal_frame(tables: PaperTables) -> pl.DataFrame:
    """Table 2: one row for each nominal ε and method."""
    rows = [
        {"nominal": row.nominal, "method": method} | _flat(values)
        for row in tables.table_2
        for method, *_ in _METHODS
        if (values := getattr(row, method)) is not None
    ]
    printed = [
        {"nominal": row.nominal, "method": "paper", "average": row.printed_average, "observed": row.printed_observed}
        for row in tables.table_2
    ]
    return pl.concat([pl.DataFrame(printed), pl.DataFrame(rows, infer_schema_length=None)], how="diagonal")


def _flat(row: Any) -> dict[str, float]:
    """The fields of a row; of a rate with its interval."""
    flat: dict[str, float] = {}
    for name, value in vars(row).items():
        if isinstance(value, Rate):
            flat |= {name: value.value, f"{name}_low": value.low, f"{name}_high": value.high}
        else:
            flat[name] = value
    return flat


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
        hover=[f"{name}: {percent(rate.value)} ({interval(rate.low, rate.high)})" for _, rate in shown],
    )  # fmt: skip
