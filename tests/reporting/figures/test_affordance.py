"""The sketch names every feature once."""

from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.reporting.figures.affordance import affordance_figure
from coverdrive.reporting.plotting.drawing import inline_svg


def test_every_feature_has_its_number() -> None:
    (axes,) = affordance_figure().axes
    numbers = sorted(int(text.get_text()) for text in axes.texts if text.get_text().isdigit())
    assert numbers == list(range(1, len(FEATURES) + 1))


def test_svg_follows_the_colours_of_the_page() -> None:
    svg = inline_svg(affordance_figure())
    assert svg.startswith("<svg")
    assert "var(--road)" in svg and "var(--paper)" in svg
    assert svg == inline_svg(affordance_figure())
