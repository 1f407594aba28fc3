"""Tables of closed-loop studies for the terminal."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from jaxtyping import Num
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.certificate import Certificate
from coverdrive.numbers import at_most
from coverdrive.reporting.claim import strength, whose
from coverdrive.reporting.fitting import FittingTable
from coverdrive.simulation.comparison import Comparison, Difference
from coverdrive.simulation.outcome import Cause, Fault
from coverdrive.simulation.statistics import PAPER, PAPER_TRIALS, MissRate, collision_table, miss_rate

_STATUSES = ("solved", "fallback", "rear", "unsafe", "blind")

_NOTABLE = 0.1
"""[m] by which a body has to leave the road to be counted"""

_ROWS = 8
"""numbers of vehicles that get a row each; more are put together"""


def collisions_table(trials: pl.DataFrame) -> Table:
    """Collisions of the ego by number of uncontrolled vehicles, with 95 % intervals, and the paper's."""
    table = FittingTable(title="Collisions (95 % Clopper–Pearson intervals)")
    for name in ("vehicles", "trials", "frontal or side", "rear-end"):
        table.add_column(name, justify="right")
    rows = collision_table(trials).iter_rows(named=True)
    for row in rows if trials["vehicles"].n_unique() <= _ROWS else list(rows)[-1:]:
        cells = (_rate(row[kind], row["trials"]) for kind in PAPER)
        table.add_row("all" if row["vehicles"] is None else str(row["vehicles"]), str(row["trials"]), *cells)
    paper = (_rate(count, PAPER_TRIALS, 2) for count in PAPER.values())
    table.add_row("paper", str(PAPER_TRIALS), *paper, style="dim")
    return table


def _rate(count: int, trials: int, digits: int = 1) -> str:
    low, high = clopper_pearson(count, trials)
    return f"{count}  ({low:.{digits}%}–{high:.{digits}%})"


def safety_table(trials: pl.DataFrame, certificates: Sequence[Certificate] = ()) -> Table:
    """Why the ego collided, and how often vehicles left their predicted sets beside the bounds of certificates."""
    table = _facts("Faults, failures and misses")
    collided = trials.filter(pl.col("kind") != "finished")
    for cause, text in (
        (Cause.PREDICTION, "collisions after a prediction miss: with a vehicle that had left its set"),
        (Cause.PLANNING, "planning failures: collisions with a vehicle that had not"),
    ):
        count = int((collided["cause"] == cause.value).sum())
        table.add_row(text, f"{_rate(count, trials.height)} of {trials.height} trials")
    faults = {fault: int((collided["at_fault"] == fault.value).sum()) for fault in Fault}
    table.add_row("at fault: ego / other / nobody", " / ".join(str(count) for count in faults.values()))
    bounds = {certificate.unit: certificate for certificate in certificates}
    windows = miss_rate(trials, "prediction_misses", "windows")
    vehicles = miss_rate(trials, "vehicles_missed", "vehicles_seen")
    table.add_row("windows that left their set", _missed(windows, bounds.get("window")))
    each = windows.total / max(vehicles.total, 1)
    table.add_row(f"vehicles that left a set ({each:.0f} windows each)", _missed(vehicles, bounds.get("vehicle")))
    table.add_row("choices that the predictor calls impossible", str(trials["impossible_choices"].sum()))
    return table


def _missed(rate: MissRate, bound: Certificate | None) -> str:
    observed = (
        f"{rate.missed / max(rate.total, 1):.2%} ({rate.missed} of {rate.total}; 95 % {rate.low:.2%}–{rate.high:.2%})"
    )
    if bound is None:
        return observed
    said = f"at most {at_most(bound.epsilon)} of {whose(bound)}, {strength(bound)}"
    return f"{observed}; bound in traffic like the recorded one: {said}"


def drives_table(trials: pl.DataFrame) -> Table:
    """How the ego drove, and how long planning took."""
    table = _facts("Drives")

    def values(name: str) -> Num[np.ndarray, " trials"]:
        return trials[name].to_numpy()

    def low_quantile(name: str, unit: str) -> str:
        smallest, tenth = np.quantile(values(name), [0, 0.1], method="lower")
        return f"least {smallest:.2f} {unit}, 1 of 10 trials at most {tenth:.2f} {unit}"

    time = values("time")
    shares = (np.average(values(f"share_{status}"), weights=time) for status in _STATUSES)
    table.add_row(
        "mean speed, progress", f"{values('mean_speed').mean():.1f} m/s, {values('distance').mean():.0f} m per trial"
    )
    table.add_row(
        "lane changes, overtakes per trial",
        f"{values('lane_changes').mean():.2f}, {values('overtakes').mean():.2f}",
    )
    table.add_row("gap to another vehicle", low_quantile("minimum_gap", "m"))
    table.add_row("time to collision", low_quantile("minimum_time_to_collision", "s"))
    table.add_row(
        "jerk along / across, hardest braking",
        f"{values('jerk_longitudinal').mean():.1f} / {values('jerk_lateral').mean():.1f} m/s³ (mean of root mean "
        f"squares), {values('hardest_braking').max():.1f} m/s²",
    )
    table.add_row(
        "plans with slack",
        f"{np.average(values('share_slack'), weights=time):.1%}, largest {values('maximum_slack').max():.2f}",
    )
    table.add_row(f"plans {' / '.join(_STATUSES)}", " / ".join(f"{share:.2%}" for share in shares))
    table.add_row(
        "prediction and planning per step",
        f"median {1e3 * np.median(values('planning_median')):.1f} ms, "
        f"99th percentile {1e3 * np.median(values('planning_p99')):.1f} ms (each of the median trial), "
        f"slowest {1e3 * values('planning_maximum').max():.1f} ms",
    )
    departure = values("road_departure")
    table.add_row(
        "trials in which the car left the road",
        f"{(departure > _NOTABLE).sum()} by more than {_NOTABLE} m, at most {departure.max():.2f} m",
    )
    table.add_row("traffic found no free choice", f"{values('traffic_stuck').sum()} times")
    table.add_row("uncontrolled vehicles that overlapped", f"{values('traffic_collisions').sum()} pairs")
    return table


def sweep_table(variants: Mapping[str, pl.DataFrame]) -> Table:
    """One line for each variant of a sweep, by the last parts of the names of its settings."""
    table = FittingTable(title="Sweep (95 % intervals)", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("variant", overflow="fold")
    for name in ("trials", "frontal or side", "rear-end", "windows missed", "m/s", "ms"):
        table.add_column(name, justify="right")
    for name, trials in variants.items():
        total = collision_table(trials).row(-1, named=True)
        missed = miss_rate(trials, "prediction_misses", "windows")
        table.add_row(
            Text(re.sub(r"[\w.]+\.(\w+=)", r"\1", name)),
            str(trials.height),
            *(_rate(total[kind], trials.height) for kind in PAPER),
            f"{missed.missed / max(missed.total, 1):.2%} ({missed.low:.2%}–{missed.high:.2%})",
            f"{trials['mean_speed'].mean():.1f}",
            f"{1e3 * np.median(trials['planning_median'].to_numpy()):.1f}",
        )
    table.caption = "ms: prediction and planning of a step, median of the median trial"
    return table


def comparison_table(comparison: Comparison) -> Table:
    """Paired differences of two studies, with 95 % intervals."""
    table = FittingTable(
        title=f"Second minus first, {comparison.trials} pairs of trials",
        box=SIMPLE_HEAD,
        padding=0,
        show_edge=False,
    )
    table.add_column("measure")
    for name in ("first", "second", "difference (95 %)", "p", "pairs"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in comparison.collisions:
        first, second = each.only or (0, 0)
        table.add_row(
            each.name.replace("_", " "),
            f"{each.first:.1%}",
            f"{each.second:.1%}",
            f"{each.value:+.1%} ({each.low:+.1%} … {each.high:+.1%})",
            _probability(each.p),
            f"{first}:{second}",
        )
    for each in comparison.measures:
        table.add_row(each.name.replace("_", " "), *_numbers(each), _probability(each.p), str(each.pairs))
    table.caption = (
        "collisions: exact sign test on the trials in which only the first : only the second collided, Newcombe's "
        "interval; all else: paired t, on pairs in which both are finite"
    )
    return table


def _numbers(each: Difference) -> tuple[str, ...]:
    return (
        *(f"{mean:.4g}" if abs(mean) >= 1 else f"{mean:.3g}" for mean in (each.first, each.second)),
        f"{each.value:+.3g} ({each.low:+.3g} … {each.high:+.3g})",
    )


def _probability(p: float) -> str:
    return "<0.001" if p < 0.001 else f"{p:.2g}"


def _facts(title: str) -> Table:
    table = FittingTable(title=title, show_header=False)
    table.add_column(style="dim")
    table.add_column()
    return table
