"""The table of the league: one line for every entrant in every world, with 95 % intervals.

Rates of collisions, and of problems that are solved, have Clopper–Pearson intervals, means Student's over drives.
Differences are to the first entrant of the world, drive by drive: Student's of the paired differences, of rates
Newcombe's (`coverdrive.simulation.studies.comparison`). Replays of recorded scenes depend on each other, and
have none.
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import polars as pl
from jaxtyping import Bool, Float

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.simulation.measures.notable import COLLIDED, OWN_FAULT
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.studies.comparison import mean_interval, newcombe_interval

MEASURES = (
    "mean_speed",
    "share_unsafe",
    "jerk_longitudinal",
    "usual_headway",
    "minimum_gap",
    "planning_median",
    "progress",
)
"""columns of the trials, the last of `coverdrive.league.problems` alone, of which the mean over drives is compared"""

COUNTS = ("at_fault", "not_at_fault", "solved", "off_road")
"""collisions of the ego at its own fault, and all others; of planning problems also those that are solved, and those on
which it left the road"""

_CONFIDENCE = 0.95
_SIGNS = ("low", "high", "minus", "minus_low", "minus_high")


SCHEMA = pl.Schema(
    {"world": pl.String(), "planner": pl.String(), "sets": pl.String(), "drives": pl.Int64()}
    | dict.fromkeys(COUNTS, pl.Int64())
    | dict.fromkeys((*MEASURES, "least_gap"), pl.Float64())
    | {f"{name}_{sign}": pl.Float64() for name in (*COUNTS, *MEASURES) for sign in _SIGNS}
    | {"left_out": pl.String()}
)
"""of the table: what is proved of the ``sets`` and their scale λ, null where that is not known; a count or a mean,
``…_low`` and ``…_high`` of the rate or mean, and ``…_minus`` with its interval, the difference to the first entrant;
``least_gap`` [m] of all drives; the reason where an entrant was ``left_out``"""


def league_table(
    driven: Mapping[tuple[str, str], pl.DataFrame | str],
    replayed: Collection[str] = (),
    sets: Mapping[tuple[str, str], str] | None = None,
) -> pl.DataFrame:
    """The table.

    Args:
        driven: by world and entrant, the first entrant of every world first: the table of its trials, or why there is
            none.
        replayed: worlds of recorded scenes, where all ends of intervals are null.
        sets: what is claimed of those with which entrants drive, if anything is.
    """
    rows: list[dict[str, Any]] = []
    first: dict[str, pl.DataFrame] = {}
    for (world, planner), found in driven.items():
        known = {"world": world, "planner": planner, "sets": (sets or {}).get((world, planner)) or None}
        if isinstance(found, pl.DataFrame):
            table = found if "solved" in found.columns else found.filter(STARTED)
            found = str(found["reason"][0]) if table.is_empty() else table
        if isinstance(found, str):
            rows.append(known | {"drives": 0, "left_out": found})
            continue
        usual = first.setdefault(world, found)
        line = known | _line(found) | ({} if usual is found else _differences(usual, found))
        unknown = (name for name in line if world in replayed and name.endswith(("_low", "_high")))
        rows.append(line | dict.fromkeys(unknown))
    return pl.DataFrame(rows, schema=SCHEMA)


def _counted(table: pl.DataFrame) -> dict[str, Bool[np.ndarray, " n"]]:
    """Which drives count, by those of the `COUNTS` that are known; what a judge alone sees is nobody's fault."""
    own = OWN_FAULT.fill_null(False)
    others = (COLLIDED | pl.col("reason").fill_null("").str.starts_with("collision")) & ~own
    judged = [name for name in ("solved", "off_road") if name in table.columns]
    return {each.name: each.to_numpy() for each in table.select(*judged, at_fault=own, not_at_fault=others)}


def _values(table: pl.DataFrame, name: str) -> Float[np.ndarray, " n"]:
    """A measure of all drives, not a number where it is unknown: of plans without paths, and if nobody planned."""
    if name not in table.columns:
        return np.full(table.height, np.nan)
    values = table[name].to_numpy().astype(float)
    unknown = ~np.isfinite(values)
    if name == "share_unsafe":
        unknown |= table["share_invalid_input"].to_numpy() >= 1
    if name == "planning_median":
        unknown |= values <= 0
    return np.where(unknown, np.nan, values)


def _line(table: pl.DataFrame) -> dict[str, Any]:
    """Counts and means with intervals."""
    line: dict[str, Any] = {"drives": table.height, "least_gap": table["minimum_gap"].min()}
    for name, counted in _counted(table).items():
        count = int(counted.sum())
        line |= {name: count} | _named(name, clopper_pearson(count, table.height, _CONFIDENCE))
    for name in MEASURES:
        line |= _mean(name, _values(table, name))
    return line


def _differences(usual: pl.DataFrame, table: pl.DataFrame) -> dict[str, Any]:
    """Differences to the usual, of the trials that both drove."""
    trials = usual.select("trial").join(table.select("trial"), on="trial", maintain_order="left")
    if trials.is_empty():
        return {}
    ours, theirs = (trials.join(each, on="trial", maintain_order="left") for each in (usual, table))
    line: dict[str, Any] = {}
    for (name, one), other in zip(_counted(ours).items(), _counted(theirs).values(), strict=True):
        line |= {f"{name}_minus": float(other.mean() - one.mean())}
        line |= _named(f"{name}_minus", newcombe_interval(one, other, _CONFIDENCE))
    for name in MEASURES:
        line |= _mean(f"{name}_minus", _values(theirs, name) - _values(ours, name))
    return line


def _mean(name: str, values: Float[np.ndarray, " n"]) -> dict[str, float | None]:
    """Of those values that are known."""
    known = values[~np.isnan(values)]
    return {name: float(known.mean()) if len(known) else None} | _named(name, mean_interval(known, _CONFIDENCE))


def _named(name: str, interval: tuple[float | None, float | None]) -> dict[str, float | None]:
    return {f"{name}_low": interval[0], f"{name}_high": interval[1]}
