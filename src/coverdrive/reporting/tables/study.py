"""Tables of closed-loop studies for the terminal."""

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import polars as pl
from rich.box import HEAVY_HEAD
from rich.table import Table
from rich.text import Text

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Rate
from coverdrive.percentages import change, interval, percent
from coverdrive.plan import Status
from coverdrive.reporting.claim import proved
from coverdrive.reporting.tables.fitting import columns_table, facts_table, or_none
from coverdrive.simulation.drives.outcome import Cause, Fault
from coverdrive.simulation.measures.misses import NEAR
from coverdrive.simulation.measures.notable import COLLIDED
from coverdrive.simulation.measures.statistics import (
    DEPENDENT,
    PAPER,
    PAPER_TRIALS,
    braking_behind,
    collision_table,
    median_headway,
    miss_rate,
    misses_by_manoeuvre,
    plan_share,
    telling_rows,
)
from coverdrive.simulation.studies.comparison import Comparison, Difference

_NOTABLE = 0.1
"""[m] by which a body has to leave the road to be counted"""


def collisions_table(trials: pl.DataFrame, replayed: bool = False) -> Table:
    """Collisions of the ego by number of uncontrolled vehicles, and the paper's; with 95 % intervals but of replays."""
    rows = [
        ("all" if row["vehicles"] is None else str(row["vehicles"]), str(row["trials"]),
         *(_rate(row[kind], row["trials"], replayed) for kind in PAPER))
        for row in telling_rows(collision_table(trials, replayed)).iter_rows(named=True)
    ]  # fmt: skip
    rows.append(("paper", str(PAPER_TRIALS), *(_rate(count, PAPER_TRIALS, replayed) for count in PAPER.values())))
    title = f"Collisions ({DEPENDENT if replayed else '95 % Clopper–Pearson intervals'})"
    columns = ("vehicles", "trials", "frontal or side", "rear-end")
    table = columns_table(title, columns, rows, box=HEAVY_HEAD, padding=(0, 1), show_edge=True)
    table.rows[-1].style = "dim"
    return table


def _rate(count: int, trials: int, replayed: bool) -> str:
    return str(count) if replayed else f"{count} ({interval(*clopper_pearson(count, trials))})"


def safety_table(trials: pl.DataFrame, certificates: Sequence[Certificate] = (), replayed: bool = False) -> Table:
    """Why the ego collided, and how often vehicles left the sets that were planned against, beside their bounds."""
    collided = trials.filter(COLLIDED)
    causes = {cause: Rate.of((trials["cause"] == cause.value).fill_null(False).to_numpy()) for cause in Cause}
    causes = {cause: rate.alone if replayed else rate for cause, rate in causes.items()}
    bounds = {certificate.unit: certificate for certificate in certificates}
    windows = miss_rate(trials, "prediction_misses", "windows", replayed)
    vehicles = miss_rate(trials, "vehicles_missed", "vehicles_seen", replayed)
    shares = miss_rate(trials, "shares_missed", "vehicles_seen", replayed)
    near = miss_rate(trials, "near_shares_missed", "near_seen", replayed)
    each = windows.total / max(vehicles.total, 1)
    return facts_table("Faults, failures and misses" + f" ({DEPENDENT})" * replayed, [
        ("collisions after a prediction miss: with a vehicle that had left its set", str(causes[Cause.PREDICTION])),
        ("planning failures: collisions with a vehicle that had not", str(causes[Cause.PLANNING])),
        ("collisions from hopeless starts: no plan was ever clear", str(causes[Cause.START])),
        ("at fault: ego / other / nobody",
         " / ".join(str((collided["at_fault"] == fault.value).sum()) for fault in Fault)),
        ("windows that left their set", _missed(windows, bounds.get("window"))),
        *((f"  {name}", str(rate)) for name, rate in misses_by_manoeuvre(trials, replayed).items()),
        ("share of a vehicle's windows that left their set", _missed(shares, bounds.get("share"))),
        (f"  of vehicles within {NEAR:g} m of the ego, while they are", _missed(near, bounds.get("share"))),
        (f"vehicles that left a set ({each:.0f} windows each)",
         _missed(vehicles, bounds.get("vehicle", bounds.get("group")))),
        ("choices that the predictor calls impossible", str(trials["impossible_choices"].sum())),
    ])  # fmt: skip


def _missed(rate: Rate, bound: Certificate | None) -> str:
    return str(rate) if bound is None else f"{rate}; bound in traffic like the recorded one: {proved(bound)}"


def drives_table(trials: pl.DataFrame) -> Table:
    """How the ego drove, and how long planning took."""

    def least(name: str, unit: str) -> str:
        smallest, tenth = np.quantile(trials[name].to_numpy(), [0, 0.1], method="lower")
        others = f", 1 of 10 trials at most {tenth:.2f} {unit}" if np.isfinite(tenth) else ""
        return or_none(smallest, f"least {{:.2f}} {unit}") + others

    mean, median, most, total = (
        each.row(0, named=True) for each in (trials.mean(), trials.median(), trials.max(), trials.sum())
    )
    behind = braking_behind(trials)
    often, half = (median_headway(trials, name) for name in ("usual_headway", "median_headway"))
    return facts_table("Drives", [
        ("mean speed, progress", f"{mean['mean_speed']:.1f} m/s, {mean['distance']:.0f} m per trial"),
        ("lane changes, overtakes per trial", f"{mean['lane_changes']:.2f}, {mean['overtakes']:.2f}"),
        ("gap to another vehicle", least("minimum_gap", "m")),
        ("time to collision", least("minimum_time_to_collision", "s")),
        ("time headway in 9 of 10 moments behind somebody, in half of them",
         or_none(often, f"{{:.2f}}, {half:.2f} s in the median trial")),
        ("time headway", least("minimum_headway", "s")),
        ("time headway left to the one behind", least("minimum_left", "s")),
        ("distance to one alongside", least("minimum_beside", "m")),
        ("jerk along / across, hardest braking",
         f"{mean['jerk_longitudinal']:.1f} / {mean['jerk_lateral']:.1f} m/s³ (mean of root mean squares), "
         f"{most['hardest_braking']:.1f} m/s²"),
        *([] if behind is None else [
            ("hardest braking of the one behind (in replays as recorded)",
             f"{behind[0]:.1f} m/s² in the median trial, 1 of 20 trials at least {behind[1]:.1f} m/s²")]),
        ("plans with slack", f"{percent(plan_share(trials, 'slack'))}, largest {most['maximum_slack']:.2f}"),
        (f"plans {' / '.join(status.value for status in Status)}",
         " / ".join(percent(plan_share(trials, status.name.lower())) for status in Status)),
        ("prediction and planning per step",
         f"median {1e3 * median['planning_median']:.1f} ms, "
         f"99th percentile {1e3 * median['planning_p99']:.1f} ms (each of the median trial), "
         f"slowest {1e3 * most['planning_maximum']:.1f} ms"),
        ("trials in which the car left the road",
         f"{(trials['road_departure'] > _NOTABLE).sum()} by more than {_NOTABLE} m, "
         f"at most {most['road_departure']:.2f} m"),
        ("traffic found no free choice", f"{total['traffic_stuck']} times"),
        ("uncontrolled vehicles that overlapped", f"{total['traffic_collisions']} pairs"),
    ])  # fmt: skip


def sweep_table(variants: Mapping[str, pl.DataFrame], replayed: Collection[str] = ()) -> Table:
    """One line for each variant of a sweep, by the last parts of the names of its settings; some are ``replayed``."""
    return columns_table(
        "Sweep (95 % intervals)",
        ("variant", "trials", "frontal or side", "rear-end", "windows missed", "m/s", "ms"),
        [_variant(name, trials, name in replayed) for name, trials in variants.items()],
        "ms: prediction and planning of a step, median of the median trial" + f"; {DEPENDENT}" * bool(replayed),
        first={"overflow": "fold"},
    )


def _variant(name: str, trials: pl.DataFrame, replayed: bool) -> tuple[str | Text, ...]:
    total = collision_table(trials, replayed).row(-1, named=True)
    missed = miss_rate(trials, "prediction_misses", "windows", replayed)
    return (
        Text(re.sub(r"[\w.]+\.(\w+=)", r"\1", name)),
        str(trials.height),
        *(_rate(total[kind], trials.height, replayed) for kind in PAPER),
        missed.brief,
        f"{trials['mean_speed'].mean():.1f}",
        f"{1e3 * np.median(trials['planning_median'].to_numpy()):.1f}",
    )


def comparison_table(comparison: Comparison) -> Table:
    """Paired differences of two studies, with 95 % intervals if neither replays."""
    caption = (
        "collisions: exact sign test on the trials in which only the first : only the second collided, Newcombe's "
        "interval; all else: paired t, on pairs in which both are finite; none where all pairs differ alike"
    )
    return columns_table(
        f"Second minus first, {comparison.trials} pairs of trials",
        ("measure", "first", "second", "difference (95 %)", "p", "pairs"),
        [_difference(each) for each in (*comparison.collisions, *comparison.measures)],
        f"{DEPENDENT}, and no test" if comparison.replayed else caption,
        first={},
        no_wrap=True,
        padding=0,
    )


def _difference(each: Difference) -> tuple[str, ...]:
    """Shares of trials as percentages with the pairs that differ, means as they are with all pairs."""
    if each.only is not None:
        means, changed, pairs = (percent(each.first), percent(each.second)), change, "{}:{}".format(*each.only)
    else:
        means = (_known(mean, ".4g" if abs(mean) >= 1 else ".3g") for mean in (each.first, each.second))
        changed, pairs = "{:+.3g}".format, str(each.pairs)
    interval = "–" if np.isnan(each.low) else f"{changed(each.low)} … {changed(each.high)}"
    difference = f"{changed(each.value)} ({interval})" if each.pairs else "–"
    p = "<0.001" if each.p < 0.001 else _known(each.p, ".2g")
    return each.name.replace("_", " "), *means, difference, p, pairs


def _known(value: float, form: str) -> str:
    return "–" if np.isnan(value) else f"{value:{form}}"
