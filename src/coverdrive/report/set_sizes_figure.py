"""How large the predicted sets are on scenes that neither trained nor calibrated."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from coverdrive.prediction.learned import Learned
from coverdrive.report import style


def set_sizes_figure(learned: Learned) -> Figure:
    """Draw the share of test windows by the number of possible base trajectories.

    Args:
        learned: counts of test windows by the size of their set.
    """
    counts = learned.set_sizes
    sizes = np.arange(len(counts))
    mean = float(sizes @ counts / max(counts.sum(), 1))
    with style.style():
        figure = style.new_figure(7, 4.2)
        axes = figure.subplots()
        axes.bar(sizes, 100 * counts / max(counts.sum(), 1), 0.85, color=style.BLUE)
        axes.axvline(mean, color=style.VERMILION, linestyle="--", linewidth=2, label=f"mean: {mean:.1f} of {sizes[-1]}")
        axes.set(xlabel="size of the predicted set [base trajectories]", ylabel="test windows [%]")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(True, axis="y")
        figure.legend(loc="outside upper left")
    return figure
