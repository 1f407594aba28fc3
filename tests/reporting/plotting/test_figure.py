"""Limits, ticks and JSON of a figure's specification."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.reporting.plotting.figure import Axis, Bars, Figure, Line, Panel, Points, Rule, Texts, to_json


def test_limits_hold_everything_with_a_margin_unless_they_are_given() -> None:
    marks = [
        Line(x=[0, np.nan, 10], y=[1, np.nan, 2]),
        Points(x=[4], y=[3], low=[-5], high=[20], along="x"),
        Bars(x=[12], height=[4], width=2),
        Rule(at=-4, axis="y"),
        Texts(x=[1000], y=[1000], text=["does not count"]),
    ]
    x, y = Panel(marks, Axis("x"), Axis("y", low=-6)).scales
    assert (x.low, x.high) == pytest.approx((-5 - 1.25, 20 + 1.25))
    assert (y.low, y.high) == pytest.approx((-6, 4 + 0.4))


def test_ticks_are_round() -> None:
    assert [text for _, text in Axis("", 0, 10).scaled(np.empty(0)).ticks] == ["0", "2", "4", "6", "8", "10"]
    assert [text for _, text in Axis("", -1, 1).scaled(np.empty(0)).ticks] == ["−1", "−0.5", "0", "0.5", "1"]
    assert [tick for tick, _ in Axis("", -0.3, 0.3).scaled(np.empty(0)).ticks] == [-0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3]
    assert [text for _, text in Axis("", 0.8, 60, log=True).scaled(np.empty(0)).ticks] == [
        "1",
        "2",
        "5",
        "10",
        "20",
        "50",
    ]
    assert [tick for tick, _ in Axis("", 1e-3, 100, log=True).scaled(np.empty(0)).ticks] == [
        0.001,
        0.01,
        0.1,
        1,
        10,
        100,
    ]
    assert len(Axis("", 0.15, 0.3, log=True).scaled(np.empty(0)).ticks) > 3


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_a_few_ticks_are_within_any_axis(low: float, length: float) -> None:
    scale = Axis("", low, low + length).scaled(np.empty(0))
    assert 3 <= len(scale.ticks) <= 8
    margin = 1e-6 * length
    assert all(low - margin <= tick <= low + length + margin for tick, _ in scale.ticks)


def test_an_axis_of_logarithms_leaves_out_what_has_none() -> None:
    scale = Axis("", log=True).scaled(np.array([0.0, -1.0, 1.0, 100.0, np.inf]))
    assert 0 < scale.low < 1 < 100 < scale.high < 200
    assert Axis("", log=True).scaled(np.zeros(1)).low > 0


def test_json_is_short_and_without_what_is_not_finite() -> None:
    line = Line(x=np.array([0, 1 / 3]), y=[np.nan, 2], name="one", step=True)
    (panel,) = to_json(Figure([[Panel([line], Axis("x"), Axis("y"))]], 2.0, "said"))["rows"][0]["panels"]
    assert panel["marks"] == [{"type": "Line", "x": [0.0, 0.33333], "y": [None, 2.0], "name": "one", "step": True}]
    assert panel["x"]["label"] == "x" and panel["x"]["ticks"][0] == (0.0, "0")
    json.dumps(panel, allow_nan=False)


def test_rows_share_the_height_of_the_figure() -> None:
    panel = Panel([], Axis(""), Axis(""))
    rows = to_json(Figure([[panel], [panel, panel]], 4.0, heights=(3, 1)))["rows"]
    assert [row["height"] for row in rows] == [3.0, 1.0]
