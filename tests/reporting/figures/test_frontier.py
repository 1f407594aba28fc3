"""A sketch of the frontier shows every point where it is, and ours with its interval."""

from xml.etree import ElementTree

import polars as pl
import pytest
from report_fakes import make_frontier

from coverdrive.reporting.figures.frontier import frontier_figure, frontier_sketch
from coverdrive.reporting.plotting.figure import Texts

WIDE, HIGH, EDGE = 230, 74, 6


def parts(svg: str) -> tuple[list[tuple[str, float, float]], list[float], str]:
    """Kind and place of every point, both ends of the interval, and what is read aloud."""
    root = ElementTree.fromstring(svg)
    points = [(each.get("class"), float(each.get("cx")), float(each.get("cy"))) for each in root.iter("circle")]
    (interval,) = [each.get("d") for each in root.iter("path") if each.get("class") == "here"]
    ends = [float(each) for each in (interval[1:].split()[0], interval.split("H")[1])]
    return points, ends, root.get("aria-label")


def test_faster_is_higher_and_more_contacts_are_further_right() -> None:
    points, ends, said = parts(frontier_sketch(make_frontier(), 0.5))
    assert [kind for kind, *_ in points] == ["ours", "ours", "ours", "other", "here"]
    four, one, none, other, here = points
    assert four[1:] == (WIDE - EDGE, EDGE)
    assert other[2] == HIGH - EDGE and other[1] == pytest.approx(EDGE + (WIDE - 2 * EDGE) * 2 / 4, abs=0.1)
    assert here[1] == none[1] == EDGE < one[1] < other[1] and four[2] < here[2] < one[2] < none[2] < other[2]
    assert ends == [EDGE, pytest.approx(EDGE + (WIDE - 2 * EDGE) * 0.002 / 0.04, abs=0.1)]
    assert said.startswith("0 of 2,301 collided at 34.5 m/s; ") and said.endswith("up to 4 % collided")


def test_the_pilot_stands_out_where_nothing_was_driven_to_prove() -> None:
    pilot = make_frontier().filter(pl.col("drives_of") == "pilot")
    points, ends, said = parts(frontier_sketch(pilot, 0.5))
    assert points[-1][0] == "here" and len(points) == 4 and said.startswith("1 of 100 collided at 34.0 m/s")
    assert ends[1] == WIDE - EDGE  # the interval is the widest of all that is shown


def test_drives_that_are_all_alike_are_one_point() -> None:
    ours = make_frontier().tail(1)
    points, _, _ = parts(frontier_sketch(ours, 0.5))
    assert points == [("here", EDGE, HIGH - EDGE)]


def test_every_point_of_ours_says_its_scale_and_is_hidden_with_it() -> None:
    panel = frontier_figure(make_frontier()).panels[0]
    words = [(mark.text, mark.name, mark.x, mark.y) for mark in panel.marks if isinstance(mark, Texts)]
    pilot = [([f"λ = {scale:g}"], "default, pilot", [x], [y]) for scale, x, y in ((0, 4, 35), (0.5, 1, 34), (1, 0, 32))]
    assert words == [*pilot, (["λ = 0.5"], "default, proof", [0.0], [34.5])]
