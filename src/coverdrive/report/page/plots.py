"""Plotly figures of the page: data and layout from Python, colours of the background from the page's style sheet."""

from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go
import plotly.io

HEIGHT = 380
"""[pixel] of a figure"""
WIDE_TEXT = "wide text"
"""``meta`` of a trace whose text is left out where the figure is narrow"""


@dataclass(frozen=True)
class Plot:
    """One figure of the page with the sentence below it."""

    name: str
    """unique on the page"""
    figure: go.Figure
    caption: str
    """the sentence below it"""
    wide: bool = False
    """whether it takes the whole width of the page"""

    @property
    def json(self) -> str:
        """Data and layout as JSON that may stand inside HTML."""
        text = plotly.io.to_json(self.figure)
        return str(text).replace("<", "\\u003c")

    @property
    def height(self) -> int:
        """Of the figure [pixel]."""
        return int(self.figure.layout.height)


def plot(name: str, traces: list[Any], caption: str, *, x: str, y: str, wide: bool = False, **layout: Any) -> Plot:
    """A figure with one pair of axes.

    Args:
        name: unique on the page.
        traces: Plotly traces.
        caption: the sentence below the figure.
        x: label of the horizontal axis, with its unit.
        y: label of the vertical axis, with its unit.
        wide: whether it takes the whole width of the page.
        layout: further layout, by Plotly's names.
    """
    figure = go.Figure(traces)
    figure.update_layout(
        template=None,
        height=HEIGHT,
        margin={"l": 58, "r": 14, "t": 36 if layout.get("showlegend", len(traces) > 1) else 10, "b": 52},
        hovermode="closest",
    )
    figure.update_layout(legend={"orientation": "h", "yanchor": "bottom", "y": 1.01, "xanchor": "left", "x": 0})
    figure.update_xaxes(title={"text": x, "standoff": 8}, automargin=True)
    figure.update_yaxes(title={"text": y, "standoff": 8}, automargin=True)
    figure.update_layout(**layout)
    return Plot(name, figure, caption, wide)
