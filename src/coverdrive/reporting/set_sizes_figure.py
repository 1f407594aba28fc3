"""How large the predicted sets are on scenes that neither trained nor calibrated."""

import numpy as np

from coverdrive.numbers import percent
from coverdrive.prediction.learned import Learned
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Bars, Figure, Panel, Rule


def set_sizes_figure(learned: Learned) -> Figure:
    """The share of test windows by the number of possible base trajectories."""
    counts = learned.set_sizes
    sizes, share = np.arange(len(counts)), counts / max(counts.sum(), 1)
    mean = float(sizes @ share)
    hover = [f"{size} possible bases: {percent(each)} of the windows" for size, each in zip(sizes, share, strict=True)]
    marks = [
        Bars(x=sizes, height=100 * share, width=0.85, hover=hover),
        Rule(at=mean, colour=style.VERMILION, name=f"mean: {mean:.1f} of {sizes[-1]}"),
    ]
    x = Axis("size of the predicted set [base trajectories]", -0.6, len(counts) - 0.4)
    return Figure(
        [[Panel(marks, x, Axis("test windows [%]", low=0))]],
        height=2.6,
        caption=f"How many of the {sizes[-1]} base trajectories are possible, on unseen scenes.",
    )
