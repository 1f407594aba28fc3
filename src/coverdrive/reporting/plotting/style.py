"""One look for all figures.

Colours are those of Okabe and Ito (2008), which remain distinct under colour blindness. Figures are not registered
with pyplot: none stays open, and no display is needed.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from coverdrive.plan import Status

BLUE, SKY, VERMILION, ORANGE = "#0072B2", "#56B4E9", "#D55E00", "#E69F00"
GREEN, PURPLE, BLACK, GREY = "#009E73", "#CC79A7", "#000000", "#8A8A8A"

CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, GREY)
"""for things that are told apart by colour, in this order"""

MARKERS = "osD^v*pHPXd"
"""the same by their marks"""

EGO, OTHER = BLUE, VERMILION
"""the ego and what it plans; the other vehicles and what is predicted for them"""

BAD = "#B3261E"
"""where a plan that is not clear first meets what was predicted"""

STATUS = MappingProxyType({Status.SOLVED: "#007A58", Status.FALLBACK: "#A8437F", Status.UNSAFE: "#B84A00",
                           Status.INVALID_INPUT: "#882255"})  # fmt: skip
"""how plans were found, dark enough to be read as text; the page has the same"""

ROAD, MARKING, PAPER = "#EFEFEF", "#A0A0A0", "#FFFFFF"
"""surface, lane markings, and the background of a figure"""

SETS = LinearSegmentedColormap.from_list("predicted sets", ["#F8C79F", "#F2BDD3", "#CFCBF2"])
"""where others may be, from now (0) over rose to lavender at the end of the prediction (1); the page has the same"""

TIMES = LinearSegmentedColormap.from_list("times of the plan", ["#B34700", "#B8327C", "#4B3FB5"])
"""where the ego plans to be, and active constraints, dark in the hue that the sets of the same time have"""

TWO_COLUMNS = 7.16
"""[inch] width of a figure over both columns of a paper"""

DPI = 200
"""dots per inch of PNG files"""

_SETTINGS: Mapping[str, Any] = MappingProxyType({
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 8,
    "axes.titlesize": 8, "axes.labelsize": 8, "xtick.labelsize": 7, "ytick.labelsize": 7,
    "legend.fontsize": 7, "legend.frameon": False,
    "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True,
    "axes.prop_cycle": cycler(color=CYCLE), "axes.linewidth": 0.6, "axes.edgecolor": "#707070",
    "grid.color": "#E3E3E3", "grid.linewidth": 0.5, "lines.linewidth": 1.2,
    "figure.facecolor": "white", "savefig.facecolor": "white",
    "pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "coverdrive", "text.usetex": False,
})  # fmt: skip


def style() -> AbstractContextManager[None]:
    """A context in which figures are made and drawn in the common look; settings outside it stay as they are."""
    return mpl.rc_context({**_SETTINGS})  # pyright: ignore[reportArgumentType]


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of the given size [inch] that lays out its own axes."""
    return Figure(figsize=(width, height), layout="constrained")
