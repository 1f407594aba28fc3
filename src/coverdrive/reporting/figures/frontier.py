"""The frontier of risk and speed, as a table for the terminal, as a figure and as a sketch beside other numbers."""

from typing import Any

import numpy as np
import polars as pl
from rich.table import Table

from coverdrive.dialling.frontier import OURS, POWER, drives_to_tell
from coverdrive.percentages import at_most, interval, percent
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Figure, Mark, Panel, Texts, crossed
from coverdrive.reporting.tables.fitting import columns_table, or_none


def frontier_table(lines: pl.DataFrame) -> Table:
    """A line for every λ and everybody beside, pilot and proof apart."""
    return columns_table(
        "Risk and speed (95 % intervals)",
        ("drives", "who", "scale", "windows", "collisions", "own", "m/s", "unsafe", "headway"),
        [_cells(line) for line in lines.iter_rows(named=True)],
        "windows: bound on what the sets miss of recorded traffic; headway: kept in 9 of 10 moments, median drive"
        + untold(lines),
        first={},
    )


_CAPTION = (
    "Collisions against the mean speed of the ego at every scale λ of the sets, and of others; up and left is better. "
    "Horizontal: 95 % Clopper–Pearson intervals, of a proof that may end at any time from 0 to a limit that holds at "
    "any time with 95 %; vertical: 95 % intervals of the mean. "
)


def frontier_figure(lines: pl.DataFrame) -> Figure:
    """Risk and speed of everybody at every scale."""
    who = lines["who"].unique(maintain_order=True).to_list()
    marks = [mark for line in lines.iter_rows(named=True) for mark in _marks(line, who.index(line["who"]))]
    panel = Panel(marks, Axis("drives with a collision [%]"), Axis("mean speed [m/s]"), title="Risk and speed")
    return Figure(
        [[panel]], height=3.4, caption=(_CAPTION + untold(lines).removeprefix("; ")).strip(), legend_columns=4
    )


_WIDE, _HIGH, _EDGE = 230, 74, 6
"""[px] of a sketch, and of the margin around what it shows"""


def frontier_sketch(lines: pl.DataFrame, scale: float) -> str:
    """All points of the frontier in an SVG of the size of a stamp, coloured by the page: ours at λ, ours, others.

    What is proved, or else the pilot at that λ, stands out with its interval.
    """
    ours = lines["who"].to_numpy() == OURS
    own = int(np.flatnonzero(ours & lines["scale"].eq_missing(scale).to_numpy())[-1])  # a proof comes after its pilot
    rates, speeds = (lines["collisions"] / lines["drives"]).to_numpy(), lines["mean_speed"].to_numpy()
    most, slow, fast = max(rates.max(), lines["rate_high"][own]), speeds.min(), max(speeds.max(), speeds.min() + 1e-3)
    x = _EDGE + (_WIDE - 2 * _EDGE) * rates / most
    y = _EDGE + (_HIGH - 2 * _EDGE) * (fast - speeds) / (fast - slow)
    kinds = np.where(ours, "ours", "other")
    dots = "".join(
        f'<circle class="{kinds[i]}" cx="{x[i]:.1f}" cy="{y[i]:.1f}" r="3"/>' for i in range(len(x)) if i != own
    )
    low, high = (_EDGE + (_WIDE - 2 * _EDGE) * lines[name][own] / most for name in ("rate_low", "rate_high"))
    side, at = ("end", x[own] - 8) if x[own] > _WIDE / 2 else ("start", x[own] + 8)
    above = y[own] + (-5 if y[own] > _HIGH / 2 else 13)
    said = (
        f"{lines['collisions'][own]} of {lines['drives'][own]:,} collided at {speeds[own]:.1f} m/s; others and other "
        f"scales between {slow:.1f} and {fast:.1f} m/s, up to {percent(float(rates.max()))} collided"
    )
    return (
        f'<svg viewBox="0 0 {_WIDE} {_HIGH}" role="img" aria-label="{said}">'
        f'<path d="M1 0V{_HIGH - 1}H{_WIDE}"/>{dots}<path class="here" d="M{low:.1f} {y[own]:.1f}H{high:.1f}"/>'
        f'<circle class="here" cx="{x[own]:.1f}" cy="{y[own]:.1f}" r="5"/>'
        f'<text class="end" x="{_WIDE}" y="10" text-anchor="end">↑ {fast:.1f} m/s</text>'
        f'<text class="end" x="{_WIDE}" y="{_HIGH - 5}" text-anchor="end">→ {percent(most, 2)} touch</text>'
        f'<text x="{at:.1f}" y="{above:.1f}" text-anchor="{side}">this one, {speeds[own]:.1f} m/s</text></svg>'
    )


def _marks(line: dict[str, Any], number: int) -> list[Mark]:
    low, high = line["rate_low"], line["rate_high"]
    scale = "" if line["scale"] is None else f", λ = {line['scale']:g}"
    said = f"{line['who']}{scale}\n{line['collisions']} of {line['drives']} collided ({interval(low, high)})"
    x, y = 100 * line["collisions"] / line["drives"], line["mean_speed"]
    name, proof = f"{line['who']}, {line['drives_of']}", line["drives_of"] == "proof"
    colour = style.CYCLE[(number + 4 * proof) % len(style.CYCLE)]
    marks = crossed(
        x, y, (100 * low, 100 * high), (line["speed_low"], line["speed_high"]), f"{said}\n{y:.2f} m/s", colour=colour,
        marker=style.MARKERS[number % len(style.MARKERS)], name=name,
    )  # fmt: skip
    if scale:
        marks.append(Texts(x=[x], y=[y], text=[scale[2:]], above=-9.0 if proof else 2.0, name=name, colour=colour))
    return marks


def _cells(line: dict[str, Any]) -> tuple[str, ...]:
    speed = f"{line['mean_speed']:.1f}"
    if line["speed_low"] is not None:
        speed += f" ({line['speed_low']:.1f}–{line['speed_high']:.1f})"
    claim = line["claim"]
    return (
        line["drives_of"],
        line["who"],
        "" if line["scale"] is None else f"{line['scale']:g}",
        "" if claim is None else "none" if claim >= 1 else f"≤ {at_most(claim)}",
        f"{line['collisions']} of {line['drives']:,} ({interval(line['rate_low'], line['rate_high'])})",
        str(line["own_fault"]),
        speed,
        percent(line["share_unsafe"], 2),
        or_none(line["headway"], "{:.2f} s"),
    )


def untold(lines: pl.DataFrame) -> str:
    """Whether the safest and the riskiest of our scales in the pilot are told apart, and how many drives would do."""
    ours = lines.filter(pl.col("who") == OURS, pl.col("drives_of") == "pilot").sort("collisions")
    if ours.height < 2:
        return ""
    best, worst = ((each["collisions"], each["drives"]) for each in (ours.row(i, named=True) for i in (0, -1)))
    needed = drives_to_tell(best, worst)
    if needed == 0:
        return ""
    likely = f"with a probability of {percent(POWER)}"
    would = "" if needed is None else f"; {needed:,} each would {likely}, if their rates are as they were seen"
    return f"; {best[1]:,} drives each do not tell the scales apart by collisions{would}"
