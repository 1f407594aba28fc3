"""Where studies drive: a road like the recorded one, the paper's, or one with a name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from command import coverdrive
from coverdrive.cli.learning.fit import Learning, fit
from coverdrive.cli.shared import bars
from coverdrive.cli.shared.options import Files, experiment_of
from coverdrive.config import Experiment
from coverdrive.errors import DataError, SettingError
from coverdrive.locks import alone
from coverdrive.prediction import fit as fitting
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.recording import Recording
from coverdrive.results import Results
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.roads.places import PLACES, Place


class SavedError(Exception):
    """What was to be saved."""

    def __init__(self, experiment: Experiment, road: str, like: Place | None):
        self.experiment, self.road, self.like = experiment, road, like


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The results folder of a command that names none."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    (recorded,) = generate(GeneratedSettings(scenes=1, duration=3.0, lanes=2, lane_width=3.4, speed=(15.0, 16.0)))
    write_parquet([recorded], tmp_path / "tracks.parquet")
    return tmp_path / "tracks.parquet"


def saved(monkeypatch: pytest.MonkeyPatch, **options: Any) -> SavedError:
    """What a fit with these options would save; nothing is learned."""

    def save_fit(results: Results, experiment: Experiment, found: None, road: str, like: Place | None, *_: Any) -> None:
        raise SavedError(experiment, road, like)

    monkeypatch.setattr(fitting, "fit", lambda *_: None)
    monkeypatch.setattr(Results, "save_fit", save_fit)
    with pytest.raises(SavedError) as kept:
        fit(learning=Learning(**options))
    return kept.value


def test_after_recordings_it_is_a_road_like_theirs(monkeypatch: pytest.MonkeyPatch, recording: Path) -> None:
    found = saved(monkeypatch, recording=[recording], settings=["episode.initial.ego_speed=11"])
    assert found.road == "recorded" and found.like is not None
    start = found.experiment.episode.initial
    assert (start.lanes, start.lane_width) == (2, 3.4)
    assert start.ego_speed == 11.0  # what is asked for holds over what is estimated
    assert 10.0 < start.traffic_speed == found.like.initial.traffic_speed < 20.0
    assert found.experiment.planner.problem.cost.reference_speed == found.like.wanted_speed < 25.0
    assert found.experiment.study.vehicles == found.like.vehicles


def test_progress_is_told_of_all_that_is_done_with_recordings(
    monkeypatch: pytest.MonkeyPatch, recording: Path, tmp_path: Path
) -> None:
    told = dict[str, list[float]]()
    monkeypatch.setattr(bars, "report", lambda _, stage, share: told.setdefault(stage, []).append(share))
    write_parquet(generate(GeneratedSettings(scenes=1, duration=3.0, lanes=2), seed=1), tmp_path / "others.parquet")
    saved(monkeypatch, recording=[recording, tmp_path / "others.parquet"])
    assert list(told) == ["recordings", "shared vehicles", "recorded place", "recorded near misses"]
    assert all(shares == sorted(shares) and {0, 0.5, 1} <= set(shares) for shares in told.values())


def test_two_do_not_learn_into_one_folder(monkeypatch: pytest.MonkeyPatch, recording: Path) -> None:
    with alone("results"), pytest.raises(DataError, match="another process writes to results"):
        saved(monkeypatch, recording=[recording])
    saved(monkeypatch, recording=[recording])


def test_where_nothing_can_be_written_nothing_is_learned(monkeypatch: pytest.MonkeyPatch, recording: Path) -> None:
    monkeypatch.setattr(fitting, "fit", lambda *_: pytest.fail("it learns"))
    with pytest.raises(OSError):
        fit(learning=Learning(recording=[recording], out=recording / "results"))


@pytest.mark.parametrize(
    ("name", "value"), [("location", "us-101"), ("format", "NGSIM"), ("map", "a.osm"), ("dt", 0.2)]
)
def test_how_recordings_are_read_is_not_said_without_any(name: str, value: Any) -> None:
    with pytest.raises(SettingError, match=f"--{name} says how recordings are read, and there are none"):
        fit(learning=Learning(files=Files(**{name: value})))


@pytest.mark.parametrize("options", [{"road": "paper"}, {"preset": "paper"}], ids=["road", "preset"])
def test_the_paper_has_its_own_road(monkeypatch: pytest.MonkeyPatch, recording: Path, options: dict[str, Any]) -> None:
    found = saved(monkeypatch, recording=[recording], **options)
    assert found.road == "paper" and found.like is not None  # a later study may ask for it
    assert found.experiment.episode == Experiment().episode
    assert found.experiment.planner.problem.cost.reference_speed == 40.0


def test_traffic_is_generated_on_the_road_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    few = ["generated.scenes=1", "generated.duration=1"]
    found = saved(monkeypatch, road="curved", settings=few)
    assert found.road == "curved" and found.like is None
    curved = PLACES["curved"].initial
    assert found.experiment.episode.initial == curved
    assert (found.experiment.generated.ramp, found.experiment.generated.curvature) == (curved.ramp, curved.curvature)
    usual = saved(monkeypatch, settings=few)
    assert usual.road == "paper" and usual.experiment.episode == Experiment().episode


@pytest.mark.parametrize("folds", [None, 4])
def test_what_was_not_recorded_is_no_road(folds: int | None) -> None:
    with pytest.raises(SettingError, match="a road like the recorded one needs recordings"):
        fit(learning=Learning(road="recorded"), folds=folds)


def test_folds_are_of_traffic_on_the_road_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def fit_folds(recordings: Sequence[Recording], *_: Any) -> None:
        assert recordings[0].road.line is not None
        raise SavedError(Experiment(), "curved", None)

    monkeypatch.setattr("coverdrive.prediction.fits.folds.fit_folds", fit_folds)
    with pytest.raises(SavedError):
        fit(learning=Learning(road="curved", settings=["generated.scenes=2", "generated.duration=5"]), folds=4)


def test_a_study_takes_the_numbers_of_vehicles_of_its_road_unless_others_are_asked_for() -> None:
    base = Experiment().updated({"study": {"vehicles": (20, 30)}})
    paper = experiment_of(base=base, road=PLACES["paper"].parts)
    assert paper == Experiment()
    asked = experiment_of(base=base, road=PLACES["paper"].parts, study={"vehicles": (9,)})
    assert asked.study.vehicles == (9,)


def test_a_road_says_what_it_replaces_of_a_file(
    monkeypatch: pytest.MonkeyPatch, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "mine.toml"
    config.write_text("seed = 5\n[episode.initial]\nlanes = 5\ngap = 3.0\n[study]\ntrials = 2\n")
    found = saved(monkeypatch, recording=[recording], road="curved", config=config)
    assert found.experiment.episode.initial.lanes == 3 and found.experiment.study.trials == 2
    said = [line for line in capsys.readouterr().err.splitlines() if "holds over" in line]
    assert said == [f"--road holds over what {config} says of episode.initial.lanes, episode.initial.gap"]
    saved(monkeypatch, recording=[recording], config=config)
    experiment_of(config, road={"seed": 5}, seed=6)  # other options say what they replace by their names
    assert "holds over" not in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["replay", "reactive-replay"])
def test_replays_are_refused_as_a_proof_before_anything_is_learned(kind: str, tmp_path: Path) -> None:
    refused = coverdrive("run", "--traffic", kind, "--risk", "0.01", "--out", tmp_path / "out", status=2)
    assert "--risk proves drives of new traffic" in refused and not (tmp_path / "out").exists()
    told = ("run", "--risk", "0.01", "--out", tmp_path / "out", "--set", f"traffic.kind={kind}")
    assert "--risk proves drives of new traffic" in coverdrive(*told, status=2)
    narrow = ("run", "--traffic", kind, "--out", tmp_path / "out", "--set", "study.until_width=0.1")
    assert "whose width could end a study" in coverdrive(*narrow, status=2) and not (tmp_path / "out").exists()
