"""How often the own car collides, with exact intervals (paper §5, Fig. 5a).

As in the paper, frontal and side collisions are counted together, and rear-end collisions apart.
"""

import polars as pl

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.simulation.outcome import Kind

_COUNTED = {"frontal_or_side": (Kind.FRONTAL.value, Kind.SIDE.value), "rear_end": (Kind.REAR_END.value,)}


def collision_table(results: pl.DataFrame, confidence: float = 0.95) -> pl.DataFrame:
    """Collisions by number of uncontrolled vehicles, and of all trials together.

    Args:
        results: one row per trial, with the columns ``vehicles`` and ``kind``.
        confidence: coverage of the intervals, in (0, 1).

    Returns:
        One row per number of vehicles, ascending, then one with ``vehicles`` null for all trials; ``trials``, and for
        ``frontal_or_side`` and ``rear_end`` the count, and the rate with the ends of its Clopper–Pearson interval as
        ``…_rate``, ``…_low``, ``…_high``.

    Raises:
        CertificateError: confidence outside (0, 1).
    """
    numbers = results["vehicles"].unique().sort().to_list()
    rows = [_row(number, results.filter(pl.col("vehicles") == number), confidence) for number in numbers]
    rows.append(_row(None, results, confidence))
    return pl.DataFrame(rows, schema_overrides={"vehicles": pl.Int64()}, infer_schema_length=None)


def _row(vehicles: int | None, results: pl.DataFrame, confidence: float) -> dict[str, int | float | None]:
    row: dict[str, int | float | None] = {"vehicles": vehicles, "trials": results.height}
    for name, kinds in _COUNTED.items():
        count = int(results["kind"].is_in(kinds).sum())
        low, high = clopper_pearson(count, results.height, confidence)
        row |= {
            name: count,
            f"{name}_rate": count / results.height if results.height else None,
            f"{name}_low": low,
            f"{name}_high": high,
        }
    return row
