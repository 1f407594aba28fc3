"""What the page on closed loops shows works."""

import re
from pathlib import Path

import pytest

from coverdrive.config import Experiment
from coverdrive.prediction.calibrate import CertificateSettings
from coverdrive.prediction.cover.basis import BasisSettings
from coverdrive.prediction.fit import PredictionSettings, fit
from coverdrive.prediction.learning.training import TrainingSettings
from coverdrive.simulation.generated import GeneratedSettings, generate

PAGE = (Path(__file__).parents[1] / "docs" / "closed-loop.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


def test_settings_are_known(tmp_path: Path) -> None:
    (block,) = blocks("toml")
    (tmp_path / "config.toml").write_text(block, encoding="utf-8")
    traffic = Experiment.load(tmp_path / "config.toml").traffic.model_dump()
    assert (traffic["kind"], traffic["moody_share"], traffic["drivers"]["time_gap"]) == ("drivers", 0.5, 1.0)


@pytest.mark.slow
def test_an_own_traffic_and_an_own_planner_make_a_study(tmp_path: Path, monkeypatch, capsys) -> None:
    settings = PredictionSettings(
        basis=BasisSettings(radius=1.0),
        training=TrainingSettings(epochs=1),
        certificate=CertificateSettings(confidence=0.9, unit="window"),
    )
    recordings = generate(GeneratedSettings(scenes=6, duration=10.0, vehicles=(8, 10)), seed=0)
    fit(recordings, settings).predictor.save(tmp_path / "results" / "predictor.safetensors")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, "closed-loop.md", "exec"), names)
    trials = names["trials"]
    assert trials.height == 10
    assert set(trials["kind"]) == {"finished", "frontal"}  # careless, among vehicles that brake
    assert "rear_end" in capsys.readouterr().out
