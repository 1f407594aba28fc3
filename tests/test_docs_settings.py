"""What the pages on roads and traffics show works."""

import re
from pathlib import Path

from coverdrive.config import Experiment

DOCS = Path(__file__).parents[1] / "docs"


def shown_on(page: str, folder: Path) -> Experiment:
    """The settings that a page shows."""
    (block,) = re.findall(r"^```toml\n(.*?)^```", (DOCS / page).read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    (folder / "config.toml").write_text(block, encoding="utf-8")
    return Experiment.load(folder / "config.toml")


def test_a_road_of_your_own(tmp_path: Path) -> None:
    start = shown_on("roads.md", tmp_path).episode.initial
    road = start.road()
    assert (road.lanes, road.speed_limit, road.length, start.smallest_radius) == (3, 25.0, 1200.0, 250.0)


def test_settings_of_traffic_are_known(tmp_path: Path) -> None:
    traffic = shown_on("traffics.md", tmp_path).traffic.model_dump()
    assert (traffic["kind"], traffic["moody_share"], traffic["drivers"]["time_gap"]) == ("drivers", 0.5, 1.0)


def test_the_roads_are_as_the_table_says() -> None:
    page = (DOCS / "roads.md").read_text(encoding="utf-8")
    for name in ("recorded", "paper", "curved"):
        assert f"| `{name}` |" in page
