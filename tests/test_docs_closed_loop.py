"""What the page on closed loops shows works."""

import re
import shutil
from pathlib import Path

import pytest

from coverdrive.config import Experiment

PAGE = (Path(__file__).parents[1] / "docs" / "closed-loop.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


def test_settings_are_known(tmp_path: Path) -> None:
    (block,) = blocks("toml")
    (tmp_path / "config.toml").write_text(block, encoding="utf-8")
    traffic = Experiment.load(tmp_path / "config.toml").traffic.model_dump()
    assert (traffic["kind"], traffic["moody_share"], traffic["drivers"]["time_gap"]) == ("drivers", 0.5, 1.0)


@pytest.mark.slow
def test_an_own_traffic_and_an_own_planner_make_a_study(quick_predictor: Path, tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "results").mkdir()
    shutil.copy(quick_predictor, tmp_path / "results")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, "closed-loop.md", "exec"), names)
    trials = names["trials"]
    assert trials.height == 10
    assert set(trials["kind"]) == {"finished", "frontal"}  # careless, among vehicles that brake
    assert "rear_end" in capsys.readouterr().out
