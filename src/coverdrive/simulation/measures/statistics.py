"""How often the ego collides and vehicles leave their predicted sets, with intervals (paper §5, Fig. 4a).

As in the paper, frontal and side collisions are counted together, and rear-end collisions apart. Trials are
independent, but for those that replay recorded scenes: these have no interval.
"""

import numpy as np
import polars as pl

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.evaluation import Rate
from coverdrive.prediction.data.manoeuvres import MANOEUVRES
from coverdrive.simulation.drives.outcome import Kind

COUNTED = {"frontal_or_side": (Kind.FRONTAL.value, Kind.SIDE.value), "rear_end": (Kind.REAR_END.value,)}
"""the kinds of collision that are counted together"""

PAPER = {"frontal_or_side": 7, "rear_end": 20}
"""what the paper reports of 1000 trials (paper §5)"""

PAPER_TRIALS = 1000

DEPENDENT = "replays of recorded scenes depend on each other: no interval"
"""why replays have none: several begin in one scene, and what is independent, groups of scenes, is not in the rows"""

FEWEST = 20
"""trials with each number of vehicles, with fewer of which a rate for every number says nothing"""


def collision_table(results: pl.DataFrame, replayed: bool = False) -> pl.DataFrame:
    """Collisions by number of uncontrolled vehicles, and of all trials together.

    One row per number of vehicles, ascending, then one with ``vehicles`` null for all trials; ``trials``, and for
    ``frontal_or_side`` and ``rear_end`` the count, and the rate with the ends of its 95 % Clopper–Pearson interval as
    ``…_rate``, ``…_low``, ``…_high``, the last two null if the trials are replays.
    """
    numbers = results["vehicles"].unique().sort().to_list()
    rows = [_row(number, results.filter(pl.col("vehicles") == number), replayed) for number in numbers]
    rows.append(_row(None, results, replayed))
    types = {"vehicles": pl.Int64()} | {f"{name}_{end}": pl.Float64() for name in COUNTED for end in ("low", "high")}
    return pl.DataFrame(rows, schema_overrides=types, infer_schema_length=None)


def telling_rows(table: pl.DataFrame) -> pl.DataFrame:
    """Of a `collision_table` the last row, after those of every number of vehicles if each has trials enough."""
    alone = table.height == 2 or min(table["trials"]) < FEWEST  # of one number all together say as much
    return table.tail(1) if alone else table


def widest_interval(results: pl.DataFrame) -> float:
    """Width of the wider one of the two 95 % intervals of the collision rates of all trials together."""
    total = collision_table(results).row(-1, named=True)
    return max(total[f"{name}_high"] - total[f"{name}_low"] for name in COUNTED)


def _row(vehicles: int | None, results: pl.DataFrame, replayed: bool) -> dict[str, int | float | None]:
    row: dict[str, int | float | None] = {"vehicles": vehicles, "trials": results.height}
    for name, kinds in COUNTED.items():
        count = int(results["kind"].is_in(kinds).sum())
        low, high = (None, None) if replayed else clopper_pearson(count, results.height)
        row |= {
            name: count,
            f"{name}_rate": count / results.height if results.height else None,
            f"{name}_low": low,
            f"{name}_high": high,
        }
    return row


def misses_by_manoeuvre(results: pl.DataFrame, replayed: bool = False) -> dict[str, Rate]:
    """Missed windows of each manoeuvre that any vehicle does, by its name in words, as of `miss_rate`."""
    return {
        words: miss_rate(results, f"misses_{name}", f"windows_{name}", replayed)
        for name, words in MANOEUVRES.items()
        if results[f"windows_{name}"].sum()
    }


def miss_rate(results: pl.DataFrame, missed: str, total: str, replayed: bool = False) -> Rate:
    """The share of windows, or of vehicles, that left their predicted sets, with a 95 % interval over trials.

    What happens in one trial is not independent, trials are, unless they are replays: then there is no interval.

    ``missed`` and ``total`` are the columns, of one row per trial, that count the misses, or sum up vehicles' shares of
    windows, and what could be missed.
    """
    misses, totals = (results[name].fill_null(0) for name in (missed, total))
    rate = Rate.of_totals(misses.to_numpy(), totals.to_numpy().astype(int))
    return rate.alone if replayed else rate


def plan_share(results: pl.DataFrame, *ways: str) -> float:
    """The share of the plans of all drives that is counted in some columns ``share_…``, summed."""
    shares = sum(results[f"share_{way}"].to_numpy() for way in ways)
    return float(np.average(shares, weights=results["time"].to_numpy()))


def median_headway(results: pl.DataFrame, name: str = "usual_headway") -> float:
    """The median [s] of a headway of all drives that came behind somebody; infinite if none did."""
    headway = results[name].to_numpy()
    known = headway[np.isfinite(headway)]
    return float(np.median(known)) if len(known) else np.inf


def braking_behind(results: pl.DataFrame) -> tuple[float, float] | None:
    """Hardest braking behind the ego [m/s²] in the median trial, and what one trial in 20 exceeds; None: not measured.

    These are the 50 % and 5 % quantiles of the least acceleration of those behind.
    """
    known = results["hardest_braking_behind"].drop_nulls().to_numpy()
    if not len(known):
        return None
    median, most = np.quantile(known, (0.5, 0.95)).tolist()
    return median, most
