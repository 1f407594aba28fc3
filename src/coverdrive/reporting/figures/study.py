"""What a study found: collisions (paper, Fig. 4a), how the ego drove, and how long prediction and planning took.

All of these are of at least one trial.
"""

import numpy as np
import polars as pl
from matplotlib.cbook import boxplot_stats

from coverdrive.percentages import interval, percent
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Bars, Figure, Line, Mark, Panel, Points, Rule, Shapes, Texts
from coverdrive.simulation.measures.statistics import DEPENDENT, PAPER, PAPER_TRIALS, collision_table, telling_rows

_KINDS = {"frontal_or_side": ("frontal or side", style.BLUE, "o"), "rear_end": ("rear-end", style.VERMILION, "s")}
"""columns of the table: name, colour and marker"""

_BAR = 0.36
"""of a bar; the numbers of vehicles are 1 apart"""

_QUARTERS = 8
"""values, with fewer of which quartiles say nothing"""

_APART = 1.6
"""from the last number of vehicles to all trials together"""

_DRIVES = {
    "mean_speed": "mean speed [m/s]",
    "minimum_gap": "least gap [m]",
    "jerk_longitudinal": "jerk along the road [m/s³]",
}
_BOX = 0.6
"""of a box; the numbers of vehicles are 1 apart"""

_TICKS = 8
"""numbers of vehicles that are named each"""

_TIMES = {
    "planning_median": ("median step of a trial", style.BLUE),
    "planning_p99": ("99th percentile of a trial", style.ORANGE),
    "planning_maximum": ("slowest step of a trial", style.VERMILION),
}


def collisions_figure(results: pl.DataFrame, replayed: bool = False) -> Figure:
    """How often the ego collides, for all trials together, and for every number of vehicles if each has enough.

    Trials that were ``replayed`` have no interval.
    """
    table = telling_rows(collision_table(results, replayed))
    place = np.arange(table.height, dtype=float)
    place[-1] += (_APART - 1) * (table.height > 1)
    numbers = [*table["vehicles"].drop_nulls().to_list(), "all"]
    ticks = {float(at): f"{n} ({trials})" for at, n, trials in zip(place, numbers, table["trials"], strict=True)}
    between = Rule(at=float(place[-1]) - _APART / 2, colour=style.MARKING, width=0.6, dashed=False)
    marks: list[Mark] = [between] if table.height > 1 else []
    for side, kind in enumerate(_KINDS):
        marks += _collisions(table, kind, place + (side - 0.5) * _BAR)
    ends = f"({DEPENDENT})" if replayed else "with its 95 % Clopper–Pearson interval"
    room = 0.6 if table.height > 1 else 1.6
    x = Axis("uncontrolled vehicles (number of trials)", -room, float(place[-1]) + room, ticks=ticks)
    return Figure(
        [[Panel(marks, x, Axis("collisions per 100 trials", low=0))]],
        height=3.1,
        caption=f"{'Collisions by number of uncontrolled vehicles' if table.height > 1 else 'Collisions'} (number of "
        f"trials in brackets): the rate as a mark {ends}, and the number of collisions above it. Dashed: the paper's "
        f"rates over all its {PAPER_TRIALS} trials.",
        legend_columns=2,
    )


def _collisions(table: pl.DataFrame, kind: str, place: np.ndarray) -> list[Mark]:
    """Rates, intervals and counts of one kind of collision, and the paper's total over all numbers of vehicles."""
    name, colour, marker = _KINDS[kind]
    parts = [f"{kind}_{part}" for part in ("rate", "low", "high")]
    hover = [
        f"{count} of {total} with a {name} collision: {percent(rate)}"
        + ("" if low is None else f" ({interval(low, high)})")
        for count, total, rate, low, high in table.select(kind, "trials", *parts).iter_rows()
    ]
    rate, low, high = (100 * table[part].to_numpy() for part in parts)
    known = not np.isnan(low).any()
    ends = (low, high) if known else (None, None)
    paper = f"paper, {name}: {PAPER[kind]} of {PAPER_TRIALS}"
    return [
        Points(x=place, y=rate, marker=marker, low=ends[0], high=ends[1], colour=colour, name=name, hover=hover),
        Bars(x=place, height=rate, width=_BAR, colour=colour, opacity=0.35, name=name),
        Texts(
            x=place,
            y=high if known else rate,
            text=[str(count) for count in table[kind]],
            anchor="middle",
            above=2,
            colour=colour,
            name=name,
        ),
        Rule(at=100 * PAPER[kind] / PAPER_TRIALS, axis="y", colour=colour, name=paper),
    ]


def drives_figure(trials: pl.DataFrame) -> Figure:
    """Mean speed, least gap if anybody was met, and jerk of every trial, by number of uncontrolled vehicles."""
    numbers = trials["vehicles"].unique().sort().to_list()
    ticks = {float(each): str(each) for each in numbers} if len(numbers) <= _TICKS else None
    x = Axis("uncontrolled vehicles", numbers[0] - 0.5, numbers[-1] + 0.5, ticks=ticks)
    panels = [Panel(_drives(trials, column, numbers), x, Axis(label, low=0)) for column, label in _DRIVES.items()]
    caption = (
        "Every trial as a dot: mean speed, least gap to another vehicle, and jerk (root mean square over the drive), "
        f"with the quartiles of all trials with as many vehicles where these are {_QUARTERS} or more; a whisker "
        "reaches over at most one and a half boxes."
    )
    return Figure([panels], height=2.6, caption=caption)


def _drives(trials: pl.DataFrame, column: str, numbers: list[int]) -> list[Mark]:
    """A box for every number of vehicles, with one dot for each trial spread over its width."""
    marks: list[Mark] = []
    for number in numbers:
        shown = trials.filter(pl.col(column).is_finite(), pl.col("vehicles") == number)
        values = shown[column].to_numpy()
        if not len(values):
            continue
        marks += _box(number, values) if len(values) >= _QUARTERS else []
        beside = number + _BOX * 0.7 * (np.modf(0.618 * np.arange(1, len(values) + 1))[0] - 0.5)
        names = shown["trial"].to_list() if "trial" in shown.columns else range(len(values))
        hover = [f"trial {trial}: {value:.2f}" for trial, value in zip(names, values, strict=True)]
        marks.append(Points(x=beside, y=values, size=3, opacity=0.6, hover=hover))
    return marks


def _box(place: float, values: np.ndarray) -> list[Mark]:
    """From quartile to quartile with the median, and whiskers to the last value within 1.5 times as far."""
    (box,) = boxplot_stats(values, whis=1.5)
    least, low, middle, high, most = (box[name] for name in ("whislo", "q1", "med", "q3", "whishi"))
    left, right = place - _BOX / 2, place + _BOX / 2
    lines_x = [left, right, np.nan, place, place, np.nan, place, place]
    lines_y = [middle, middle, np.nan, least, low, np.nan, high, most]
    corners = np.array([(left, low), (right, low), (right, high), (left, high)])
    return [Shapes(outlines=[corners]), Line(x=lines_x, y=lines_y, width=0.9)]


def planning_figure(trials: pl.DataFrame, period: float) -> Figure:
    """The share of trials whose steps took at most a given time; the next plan is due after the period [s]."""
    due = 1e3 * period
    marks: list[Mark] = [
        _steps(1e3 * trials[column].to_numpy(), name, colour) for column, (name, colour) in _TIMES.items()
    ]
    marks.append(Rule(at=due, name="next plan due (real time)"))
    x, y = Axis("prediction and planning of a step [ms]", log=True), Axis("share of the trials", low=0, high=1.02)
    return Figure(
        [[Panel(marks, x, y)]],
        height=2.6,
        caption=f"The share of the trials in which prediction and planning of a step took at most so long. The next "
        f"plan is due after {due:g} ms.",
        legend_columns=2,
    )


def _steps(milliseconds: np.ndarray, name: str, colour: str) -> Line:
    """The empirical distribution; its last value is the largest time."""
    times = np.sort(milliseconds)
    return Line(
        x=np.append(times[0], times), y=np.arange(len(times) + 1) / len(times), step=True, colour=colour, name=name,
        width=1.6, hover=f"{name}: {np.median(times):.3g} ms at half of the trials, {times[-1]:.3g} ms at most",
    )  # fmt: skip
