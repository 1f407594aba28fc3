"""What a scenario shares with recordings is left out of the fit that it is judged with."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from published_commonroad import write_commonroad
from published_formats import truth
from recordings_fakes import driving, scenario, three_lanes

from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.fits import left_out as module
from coverdrive.prediction.fits.left_out import fit_without, left_out
from coverdrive.recordings.read import read
from coverdrive.recordings.tracks.smoothing import SmoothingSettings


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    speeds = {"USA_US101-1_1_T-1": 12.0, "USA_US101-2_1_T-1": 14.0, "USA_US101-21_1_T-1": 15.0}
    for name, speed in speeds.items():
        (tmp_path / f"{name}.xml").write_text(scenario(three_lanes(), driving(100, 20.0, -1.75, speed, 40)))
    return tmp_path


def test_a_scenario_leaves_out_its_map_whatever_its_vehicles_do(folder: Path) -> None:
    changed, elsewhere = folder / "judged" / "USA_US101-2_7_T-1.xml", folder / "judged" / "DEU_A9-2_1_T-1.xml"
    changed.parent.mkdir()
    for path in (changed, elsewhere):
        path.write_text(scenario(three_lanes(), driving(100, 30.0, -5.25, 9.0, 40)))
    illegible = changed.with_name("USA_US101-1_2_T-1.xml")
    illegible.write_text(scenario(three_lanes(), ""))
    assert left_out([folder], [changed, elsewhere, illegible]) == [
        {"USA_US101-2_1_T-1"}, set(), {"USA_US101-1_1_T-1"},
    ]  # fmt: skip


@pytest.mark.slow
def test_who_is_shared_is_found_in_scenarios_of_several_carriageways(tmp_path: Path) -> None:
    """Of each of these two recordings are made."""
    files, seeds = dict[str, Path](), {"USA_Here-1_1_T-1": 5, "USA_There-2_1_T-1": 5, "DEU_Other-1_1_T-1": 3}
    for name, seed in seeds.items():
        files[name] = tmp_path / f"{name}.xml"
        write_commonroad(tmp_path, truth(0.1, seconds=5.0, seed=seed)).rename(files[name])
    here, there, other = files.values()
    both, shared = ({name, f"{name} carriageway 2"} for name in ("DEU_Other-1_1_T-1", "USA_Here-1_1_T-1"))
    assert left_out([other, here], [other, there]) == [both, shared]


def test_a_fit_is_kept_by_what_it_was_made_from(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by what that is called: other files of these names, or the same read otherwise, are fitted to anew."""
    fits, made, loaded = tmp_path_factory.mktemp("fits"), list[int](), list[str]()

    def noted(recordings: object, settings: object, seed: int) -> SimpleNamespace:
        made.append(seed)
        return SimpleNamespace(predictor=SimpleNamespace(save=lambda path: path.write_text(str(len(made)))))

    def load(path: Path) -> BoxPredictor:
        loaded.append(path.read_text())
        return object.__new__(BoxPredictor)

    monkeypatch.setattr(module, "fit", noted)
    monkeypatch.setattr(module.Predictor, "load", load)
    other = tmp_path_factory.mktemp("other")
    for file in folder.glob("*.xml"):
        (other / file.name).write_text(file.read_text().replace("<exact>14.0", "<exact>14.5"))
    smoothed = SmoothingSettings(window=2.0)
    here, *others = read(folder), read(other), read(folder, dt=0.05), read(folder, smoothing=smoothed)
    wider = [replace(each, road=replace(each.road, edges=each.road.edges * 1.01)) for each in here]
    calls = [(each, PredictionSettings(), 0) for each in (here, *others, wider)]
    calls += [(here, PredictionSettings(scale=1.0), 0), (here, PredictionSettings(), 1)]
    for recordings, settings, seed in [*calls, *calls, (read(folder), PredictionSettings(), 0)]:
        fit_without(frozenset(), recordings, settings, seed, fits)
    assert loaded == [*"1234567", *"1234567", "1"]
    fit_without(frozenset({"USA_US101-2_1_T-1"}), here, PredictionSettings(), 0, fits)
    assert loaded[-1] == "8" and len(made) == 8
