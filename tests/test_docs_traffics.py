"""What the page on traffics shows works."""

import re
from pathlib import Path

from coverdrive.config import Experiment

PAGE = (Path(__file__).parents[1] / "docs" / "traffics.md").read_text(encoding="utf-8")


def test_settings_are_known(tmp_path: Path) -> None:
    (block,) = re.findall(r"^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    (tmp_path / "config.toml").write_text(block, encoding="utf-8")
    traffic = Experiment.load(tmp_path / "config.toml").traffic.model_dump()
    assert (traffic["kind"], traffic["moody_share"], traffic["drivers"]["time_gap"]) == ("drivers", 0.5, 1.0)
