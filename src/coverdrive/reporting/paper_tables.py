"""Tables 1 and 2 of the paper with ours beside them, for the terminal and as CSV."""

from collections.abc import Sequence
from dataclasses import asdict

import polars as pl
from rich.box import SIMPLE_HEAD
from rich.table import Table

from coverdrive.certificates.evaluation import Rate
from coverdrive.certificates.paper_tables import BASES, TABLE_1, Bounds, PaperTables, Residuals
from coverdrive.reporting.fitting import FittingTable

ERRATUM = (
    "Erratum: of the bounds that the paper prints in Table 1, only the first is the 99 % bound of its Theorem 1; "
    "the other six are the 90 % bound."
)

_METHODS = ("per_base", "pooled", "pac_per_base", "pac_pooled")


def bounds_table(rows: Sequence[Bounds]) -> Table:
    """Table 1 of the paper, recomputed."""
    table = _table(
        f"Table 1 of the paper (M = {BASES}): bounds on the miss rate [%]",
        ("N₂", "printed", "99 % M+1", "90 % M+1", "99 % M−1", "99 % family", "printed observed"),
    )
    for row in rows:
        bounds = (row.printed, row.theorem, row.theorem_at_90, row.exact, row.family, row.printed_observed)
        table.add_row(f"{row.samples:,}", *(f"{100 * bound:.4g}" for bound in bounds))
    table.caption = f"{ERRATUM} M+1: Theorem 1; M−1: exact for M thresholds; family: one calibrated number."
    return table


def growth_table(tables: PaperTables, name: str) -> Table:
    """The experiment of Table 1 on other samples."""
    table = _table(
        f"Table 1 repeated on {name} (M = {tables.bases}): 99 % bounds, misses [%]",
        ("N₂", "vehicles", "M+1", "M−1", "missed", "95 %", "set", "mixed", "family", "missed", "set"),
    )
    for row in tables.table_1:
        table.add_row(
            f"{row.samples:,}",
            str(row.vehicles),
            f"{100 * row.theorem:.3f}",
            f"{100 * row.exact:.3f}",
            f"{100 * row.observed.value:.3f}",
            f"{100 * row.observed.low:.2f}–{100 * row.observed.high:.2f}",
            f"{row.set_size:.1f}",
            f"{100 * row.mixed.value:.3f}",
            f"{100 * row.family:.3f}",
            f"{100 * row.family_observed.value:.3f}",
            f"{row.family_set_size:.1f}",
        )
    table.caption = (
        f"{tables.train:,} training, {tables.calibration:,} calibration and {tables.test:,} test windows that a base "
        f"covers; left out: {tables.uncovered}. Bounds and intervals take windows for independent, as the paper does; "
        "windows of one vehicle are not, so that rates observed on new vehicles can exceed the bound. mixed: missed "
        "where windows are dealt out at random, so that each vehicle is on both sides."
    )
    return table


def conformal_table(tables: PaperTables, name: str) -> Table:
    """Table 2 of the paper, and its experiment on other samples."""
    table = _table(
        f"Table 2 repeated on {name}: average d, observed ε [%] ({tables.table_2_samples:,} calibration windows)",
        ("ε", "paper", "per base", "pooled", "PAC per base", "PAC pooled"),
    )
    for row in tables.table_2:
        table.add_row(
            f"{100 * row.nominal:g}",
            f"{row.printed_average:.4f} {100 * row.printed_observed:.3f}",
            *(_residuals(getattr(row, method)) for method in _METHODS),
        )
    table.caption = (
        "per base: the paper's method; PAC: with 99 % confidence; –: too few samples. d = 1: always possible."
    )
    return table


def bounds_frame(rows: Sequence[Bounds]) -> pl.DataFrame:
    """Table 1 of the paper, recomputed, one row for each N₂."""
    return pl.DataFrame([asdict(row) for row in rows])


def growth_frame(tables: PaperTables) -> pl.DataFrame:
    """The experiment of Table 1, beside the printed rows."""
    return pl.DataFrame(
        [
            {
                "paper_samples": printed[0],
                "paper_bound": printed[1],
                "paper_observed": printed[2],
                "samples": row.samples,
                "vehicles": row.vehicles,
                "bases": tables.bases,
                "theorem": row.theorem,
                "exact": row.exact,
                **_rate("observed", row.observed),
                "set_size": row.set_size,
                **_rate("mixed", row.mixed),
                "family": row.family,
                **_rate("family_observed", row.family_observed),
                "family_set_size": row.family_set_size,
            }
            for printed, row in zip(TABLE_1, tables.table_1, strict=True)
        ]
    )


def conformal_frame(tables: PaperTables) -> pl.DataFrame:
    """Table 2: one row for each nominal ε and method."""
    rows = [
        {"nominal": row.nominal, "method": method, "average": values.average, **_rate("observed", values.observed)}
        | {"set_size": values.set_size}
        for row in tables.table_2
        for method in _METHODS
        if (values := getattr(row, method)) is not None
    ]
    printed = [
        {"nominal": row.nominal, "method": "paper", "average": row.printed_average, "observed": row.printed_observed}
        for row in tables.table_2
    ]
    return pl.concat([pl.DataFrame(printed), pl.DataFrame(rows, infer_schema_length=None)], how="diagonal")


def _rate(name: str, rate: Rate) -> dict[str, float]:
    return {name: rate.value, f"{name}_low": rate.low, f"{name}_high": rate.high}


def _residuals(values: Residuals | None) -> str:
    return "–" if values is None else f"{values.average:.4f} {100 * values.observed.value:.3f}"


def _table(title: str, columns: Sequence[str]) -> Table:
    table = FittingTable(title=title, box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name in columns:
        table.add_column(name, justify="right")
    return table
