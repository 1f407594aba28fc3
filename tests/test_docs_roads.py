"""What the page on roads shows works."""

import re
from pathlib import Path

from coverdrive.config import Experiment

PAGE = (Path(__file__).parents[1] / "docs" / "roads.md").read_text(encoding="utf-8")


def test_a_road_of_your_own(tmp_path: Path) -> None:
    (block,) = re.findall(r"^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    (tmp_path / "config.toml").write_text(block, encoding="utf-8")
    start = Experiment.load(tmp_path / "config.toml").episode.initial
    road = start.road()
    assert (road.lanes, road.speed_limit, road.length, start.smallest_radius) == (3, 25.0, 1200.0, 250.0)


def test_the_roads_are_as_the_table_says() -> None:
    for name in ("recorded", "paper", "curved"):
        assert f"| `{name}` |" in PAGE
