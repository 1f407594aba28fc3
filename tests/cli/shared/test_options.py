"""Where settings come from: the results folder, over it a file, over that the options."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from coverdrive.cli.shared.options import experiment_in
from coverdrive.config import Experiment
from coverdrive.errors import SettingError


def test_a_file_changes_what_it_names_of_the_settings_of_a_folder(tmp_path: Path) -> None:
    fitted = Experiment().updated({"planner": {"manners": {"beside": 1.23}}, "episode": {"duration": 7.0}})
    results: Any = SimpleNamespace(experiment=fitted, place=lambda _: SimpleNamespace(parts={}))
    (tmp_path / "short.toml").write_text("[episode]\nduration = 2.0\n[study]\ntrials = 3\n")
    found = experiment_in(results, None, tmp_path / "short.toml", study={"trials": 5})
    assert found.planner.manners.beside == 1.23
    assert (found.episode.duration, found.study.trials) == (2.0, 5)
    assert experiment_in(results, None).episode.duration == 7.0


@pytest.mark.parametrize("said", ["dt=0.2", "location=here", "smoothing.window=2.5", "generated.lanes=2"])
def test_what_the_predictor_was_made_from_cannot_be_set_for_its_drives(tmp_path: Path, said: str) -> None:
    results: Any = SimpleNamespace(experiment=Experiment(), folder=tmp_path, place=lambda _: SimpleNamespace(parts={}))
    with pytest.raises(SettingError, match=rf"^{said.partition('=')[0]} made the predictor in .*; fit anew"):
        experiment_in(results, None, None, [said])
    mine = Experiment().updated({"seed": 3, "study": {"trials": 5}, "traffic": {"kind": "drivers"}})
    mine.save(tmp_path / "mine.toml")
    assert experiment_in(results, None, tmp_path / "mine.toml") == mine


@pytest.mark.parametrize("by", ["file", "set"])
def test_what_made_the_predictor_cannot_be_set_for_its_drives(tmp_path: Path, by: str) -> None:
    results: Any = SimpleNamespace(experiment=Experiment(), folder=tmp_path, place=lambda _: SimpleNamespace(parts={}))
    (tmp_path / "wide.toml").write_text("[prediction]\nscale = 0.05\n")
    given: Any = (tmp_path / "wide.toml", None) if by == "file" else (None, ["prediction.scale=0.05"])
    with pytest.raises(SettingError, match=r"prediction\.scale made the predictor in .*; fit anew"):
        experiment_in(results, None, *given)
    results.experiment.save(tmp_path / "same.toml")
    assert experiment_in(results, None, tmp_path / "same.toml") == results.experiment
