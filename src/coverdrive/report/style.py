"""One look for all figures, and how a figure becomes a file.

Colours are those of Okabe and Ito (2008), which remain distinct under colour blindness. Figures are not registered
with pyplot: none stays open, and no display is needed.
"""

import io
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from coverdrive.files import write_atomically
from coverdrive.planning.plan import Status

BLUE, SKY, VERMILION, ORANGE = "#0072B2", "#56B4E9", "#D55E00", "#E69F00"
GREEN, PURPLE, BLACK, GREY = "#009E73", "#CC79A7", "#000000", "#8A8A8A"

CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, GREY)
"""for things that are told apart by colour, in this order"""

OWN, OTHER = BLUE, VERMILION
"""the own car and what it plans; the other vehicles and what is predicted for them"""

BINDS = "#8F1D5F"
"""members of predicted sets that bind a plan"""

STATUS = MappingProxyType(
    {
        Status.SOLVED: GREEN,
        Status.FALLBACK: PURPLE,
        Status.REAR: SKY,
        Status.UNSAFE: VERMILION,
        Status.BLIND: "#882255",
    }
)
"""how plans were found; the page has the same"""

ROAD, MARKING, PAPER = "#EFEFEF", "#A0A0A0", "#FFFFFF"
"""surface, lane markings, and the background of a figure"""

SETS = LinearSegmentedColormap.from_list("predicted sets", ["#F6BF9C", "#FDEFE6"])
"""light vermilion, from now (0) to the end of the prediction (1)"""

SHARES = LinearSegmentedColormap.from_list("shares", ["#BDBDBD", "#1A1A1A"])
"""from rare (0) to common (1)"""

DPI = 150
"""dots per inch of PNG files"""

_SETTINGS: Mapping[str, Any] = MappingProxyType(
    {
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans"],
        "font.size": 11,
        "axes.titlesize": 12,
        "axes.labelsize": 11,
        "xtick.labelsize": 10,
        "ytick.labelsize": 10,
        "legend.fontsize": 10,
        "legend.frameon": False,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "axes.prop_cycle": cycler(color=CYCLE),
        "grid.color": "#E3E3E3",
        "lines.linewidth": 1.6,
        "figure.facecolor": "white",
        "savefig.facecolor": "white",
        "pdf.fonttype": 42,
        "svg.fonttype": "none",
        "svg.hashsalt": "coverdrive",
        "text.usetex": False,
    }
)


def style() -> AbstractContextManager[None]:
    """A context in which figures are made and drawn in the common look; settings outside it stay as they are."""
    return mpl.rc_context({**_SETTINGS})  # pyright: ignore[reportArgumentType]


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of the given size [inch] that lays out its own axes."""
    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, path: Path) -> tuple[Path, Path]:
    """Write a figure as PNG (150 dpi) and as PDF with embedded fonts; the same figure gives the same bytes.

    Args:
        figure: made by a function of this package, or any other.
        path: of both files, without suffix; the folder is made if need be.

    Returns:
        The PNG and the PDF file.
    """
    png, pdf = (path.with_name(path.name + suffix) for suffix in (".png", ".pdf"))
    with style():
        write_atomically(png, lambda file: figure.savefig(file, dpi=DPI))
        write_atomically(pdf, lambda file: figure.savefig(file, dpi=DPI, metadata={"CreationDate": None}))
    return png, pdf


def inline_svg(figure: Figure) -> str:
    """A figure as an SVG element to stand in a page; black, white, road and markings follow the page's colours."""
    with style(), io.StringIO() as file:
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
        text = file.getvalue()
    for colour, name in (("#000000", "ink"), (PAPER, "paper"), (ROAD, "road"), (MARKING, "marking")):
        text = text.replace(f": {colour.lower()}", f": var(--{name})")
    return text[text.index("<svg") :]
