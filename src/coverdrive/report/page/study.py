"""The closed-loop study on the page: collisions, speeds, gaps, and whether planning keeps up with real time."""

from itertools import pairwise

import numpy as np
import plotly.graph_objects as go
import polars as pl
from jaxtyping import Float

from coverdrive.numbers import percent
from coverdrive.planning.plan import Status
from coverdrive.report import style
from coverdrive.report.page.plots import WIDE_TEXT, Plot, plot
from coverdrive.simulation.notable import COLLIDED, NEARLY
from coverdrive.simulation.outcome import Cause, Fault
from coverdrive.simulation.statistics import collision_table

_KINDS = {"frontal_or_side": ("frontal or side", style.BLUE), "rear_end": ("rear-end", style.ORANGE)}
_TIMES = {
    "planning_median": ("median step", style.BLUE),
    "planning_p99": ("99th percentile", style.ORANGE),
    "planning_maximum": ("slowest step", style.VERMILION),
}
_FAULTS = {Fault.OWN: "own car", Fault.OTHER: "other vehicle", Fault.NONE: "nobody"}
_LEAST_BINS, _MOST_BINS = 6, 40
_TICKS = [value * 10**power for power in range(5) for value in (1, 2, 5)]
"""[ms]"""


def ends(trials: pl.DataFrame) -> str:
    """How many drives ended in a collision, and why, in sentences."""
    collided = trials.filter(COLLIDED)
    near = trials.filter(NEARLY).height
    unsafe = (
        f"{near} {'was a near miss' if near == 1 else 'were near misses'}. "
        f"{percent(plan_share(trials, Status.UNSAFE))} of all plans were unsafe: nothing clear of the predicted paths "
        "was found."
    )
    if collided.height == 0:
        return f"None of {trials.height} drives ended in a collision. {unsafe}"
    causes = [
        f"{cause.value}: {(collided['cause'] == cause.value).sum()}" for cause in (Cause.PLANNING, Cause.PREDICTION)
    ]
    faults = [f"{who}: {(collided['at_fault'] == fault.value).sum()}" for fault, who in _FAULTS.items()]
    return (
        f"{collided.height} of {trials.height} drives ended in a collision ({', '.join(causes)}). At fault: "
        f"{', '.join(faults)}. {unsafe}"
    )


def plan_share(trials: pl.DataFrame, *statuses: Status) -> float:
    """Share of the plans of all drives that were found in one of these ways."""
    shares = sum(trials[f"share_{status.value}"].to_numpy() for status in statuses)
    return float(np.average(shares, weights=trials["time"].to_numpy()))


def study_plots(trials: pl.DataFrame, period: float) -> list[Plot]:
    """Figures of a study.

    Args:
        trials: one row for each trial.
        period: [s] between two plans.
    """
    return [
        _collisions(trials),
        _planning(trials, period),
        _distribution("speed", trials, "mean_speed", "Mean speed of the own car in every trial.", "mean speed [m/s]"),
        _distribution(
            "gap", trials, "minimum_gap", "Least gap of the own car to another vehicle in every trial.", "least gap [m]"
        ),
    ]


def _collisions(trials: pl.DataFrame) -> Plot:
    """Bars with their intervals, and a dot at every rate, which is seen where there is no bar."""
    table = collision_table(trials)
    names = [f"{row['vehicles'] or 'all'}<br>({row['trials']})" for row in table.iter_rows(named=True)]
    bars: list[go.Bar] = []
    dots: list[go.Scatter] = []
    for kind, (name, colour) in _KINDS.items():
        rate, low, high = (100 * table[f"{kind}_{part}"].to_numpy() for part in ("rate", "low", "high"))
        counts = [f"{count} of {total}" for count, total in zip(table[kind], table["trials"], strict=True)]
        hover = f"%{{customdata}} with a {name} collision: %{{y:.3g}} %<extra></extra>"
        shared = {"x": names, "y": rate.round(4), "name": name, "customdata": counts, "hovertemplate": hover,
                  "legendgroup": kind, "offsetgroup": kind}  # fmt: skip
        bars.append(go.Bar(**shared, marker={"color": colour, "opacity": 0.55}))
        dots.append(
            go.Scatter(
                **shared, mode="markers+text", marker={"color": colour, "size": 8}, showlegend=False,
                text=[f" {count}" for count in counts], textposition="top right",
                textfont={"size": 11, "color": colour}, meta=WIDE_TEXT, cliponaxis=False,
                error_y={
                    "type": "data", "symmetric": False, "array": np.maximum(high - rate, 0).round(4),
                    "arrayminus": np.maximum(rate - low, 0).round(4), "thickness": 1.5, "width": 5, "color": colour,
                },
            )
        )  # fmt: skip
    return plot(
        "collisions", [*bars, *dots], "Collisions by number of uncontrolled vehicles (number of trials in brackets). "
        "Dots are the rates, with their 95 % Clopper–Pearson intervals.", x="uncontrolled vehicles",
        y="trials with a collision [%]", wide=True, xaxis_type="category", yaxis_rangemode="tozero",
        scattermode="group", bargap=0.15, scattergap=0.15,
    )  # fmt: skip


def _planning(trials: pl.DataFrame, period: float) -> Plot:
    """How long prediction and planning took; bins are equal on a logarithmic axis."""
    times = 1e3 * trials.select(list(_TIMES)).to_numpy()
    edges = _edges(times, 1e3 * period)
    between = [f"{low:.3g} to {high:.3g} ms" for low, high in pairwise(edges)]
    steps = [
        go.Scatter(
            x=edges.round(3), y=np.append(np.histogram(1e3 * trials[column].to_numpy(), edges)[0], 0), name=name,
            mode="lines", line={"shape": "hv", "color": colour, "width": 2}, fill="tozeroy", fillcolor=f"{colour}22",
            customdata=[*between, ""], hovertemplate=f"{name}, %{{customdata}}: %{{y}} trials<extra></extra>",
        )
        for column, (name, colour) in _TIMES.items()
    ]  # fmt: skip
    due = {"x0": 1e3 * period, "x1": 1e3 * period, "y0": 0, "y1": 1, "yref": "paper", "type": "line"}
    return plot(
        "planning", steps, f"Prediction and planning of one step, in every trial; the dashed line is real time: the "
        f"next plan is due after {1e3 * period:g} ms.", x="time [ms]", y="trials", wide=True, xaxis_type="log",
        xaxis_tickvals=_TICKS,
        shapes=[{**due, "line": {"dash": "dash", "color": style.GREY, "width": 2}}],
        annotations=[{
            "x": float(np.log10(1e3 * period)), "y": 1, "yref": "paper", "text": "real time", "showarrow": False,
            "xanchor": "left", "yanchor": "top", "xshift": 4,
        }],
    )  # fmt: skip


def _edges(times: Float[np.ndarray, "trials kinds"], due: float) -> Float[np.ndarray, " _"]:
    """Of equal bins on a logarithmic axis, more of them for more trials; what is due is an edge."""
    bins = np.clip(2 * np.sqrt(len(times)), _LEAST_BINS, _MOST_BINS)
    low, high = np.log([times.min() / 1.05, 1.05 * max(times.max(), due)]) - np.log(due)
    width = (high - low) / bins
    return due * np.exp(width * np.arange(np.floor(low / width), np.ceil(high / width) + 1))


def _distribution(name: str, trials: pl.DataFrame, column: str, caption: str, label: str) -> Plot:
    """One dot for each trial with a box, by number of vehicles."""
    boxes = [
        go.Box(
            y=group[column].to_numpy().round(3), x=[str(vehicles)] * len(group),
            boxpoints="all", jitter=0.5, pointpos=0,
            marker={"size": 5, "opacity": 0.6, "color": style.BLUE}, line={"width": 1.2, "color": style.BLUE},
            fillcolor="rgba(86,180,233,0.15)", customdata=group["trial"].to_list(),
            hovertemplate="trial %{customdata}: %{y:.2f}<extra></extra>",
        )
        for (vehicles,), group in trials.filter(pl.col(column).is_finite()).sort("vehicles").group_by(
            "vehicles", maintain_order=True
        )
    ]  # fmt: skip
    return plot(
        name, boxes, caption, x="uncontrolled vehicles", y=label, showlegend=False, xaxis_type="category",
        yaxis_rangemode="tozero",
    )  # fmt: skip
