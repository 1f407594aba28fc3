"""On which road a study from Python drives: one like that of its recordings, unless another one is named."""

from pathlib import Path

import numpy as np
import pytest
from simulation_fakes import FAST, FakeBasis, FakePredictor

from coverdrive.config import Experiment
from coverdrive.errors import SettingError
from coverdrive.planning.planner import MpcPlanner
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.roads.initial import InitialSettings
from coverdrive.simulation.roads.places import PLACES, recorded_place
from coverdrive.simulation.studies.driven_on import driven_on
from coverdrive.simulation.studies.study import Study, simulate, study

PREDICTOR = FakePredictor(FakeBasis.make())


@pytest.fixture(scope="module")
def recordings() -> tuple[Recording, ...]:
    dense = {"scenes": 2, "duration": 3.0, "vehicles": (20, 20), "speed": (15.0, 17.0)}
    return generate(GeneratedSettings(lanes=2, lane_width=3.4, **dense))


@pytest.fixture
def undriven(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Study, "run", lambda self, trials, **_: self)


def same(driven: Study, experiment: Experiment) -> bool:
    planner = driven.setup.planner
    assert isinstance(planner, MpcPlanner)
    found = planner.settings, driven.setup.episode, tuple(driven.setup.vehicles)
    return found == (experiment.planner, experiment.episode, experiment.study.vehicles)


def test_with_recordings_it_is_like_theirs(recordings: tuple[Recording, ...], tmp_path: Path, undriven: None) -> None:
    driven = study(PREDICTOR, recordings=recordings, folder=tmp_path)
    assert same(driven, Experiment().updated(recorded_place(recordings).parts))
    assert driven_on(driven.setup).startswith("Driven on a road like the recorded one: 2 straight lanes of 3.4 m;")
    assert driven.setup.scenarios == ()  # which nobody replays


@pytest.mark.parametrize(("road", "words"), [("paper", "the paper's road"), ("curved", "the road “curved”")])
def test_another_road_is_named(
    road: str, words: str, recordings: tuple[Recording, ...], tmp_path: Path, undriven: None
) -> None:
    driven = study(PREDICTOR, recordings=recordings, road=road, folder=tmp_path)
    assert same(driven, Experiment().updated(PLACES[road].parts))
    assert words in driven_on(driven.setup)


def test_without_recordings_it_is_that_of_the_paper(tmp_path: Path, undriven: None) -> None:
    assert same(study(PREDICTOR, folder=tmp_path), Experiment())
    with pytest.raises(SettingError, match="a road like the recorded one needs recordings"):
        study(PREDICTOR, road="recorded", folder=tmp_path)
    with pytest.raises(SettingError, match=r"no road 'moon'; choose one of paper, curved, recorded"):
        study(PREDICTOR, road="moon", folder=tmp_path)


def test_what_is_asked_for_holds_over_the_road(
    recordings: tuple[Recording, ...], tmp_path: Path, undriven: None
) -> None:
    asked = EpisodeSettings(duration=7.0, initial=InitialSettings(ego_speed=11.0))
    setup = study(PREDICTOR, recordings=recordings, episode=asked, vehicles=(9,), folder=tmp_path).setup
    assert (setup.episode.duration, setup.episode.initial.ego_speed, setup.vehicles) == (7.0, 11.0, (9,))
    assert setup.episode.initial.lane_width == 3.4


def test_replayed_vehicles_have_an_ego_that_wants_their_speed(
    recordings: tuple[Recording, ...], tmp_path: Path, undriven: None
) -> None:
    driven = study(PREDICTOR, recordings=recordings, traffic="replay", folder=tmp_path)
    assert len(driven.setup.scenarios) == 2
    assert driven_on(driven.setup).endswith(f"the ego wants {recorded_place(recordings).wanted_speed:g} m/s.")


def test_one_drive_is_on_the_same_road(recordings: tuple[Recording, ...]) -> None:
    trace = simulate(PREDICTOR, recordings=recordings, episode=FAST)
    place = recorded_place(recordings)
    assert np.array_equal(trace.road.edges, place.initial.road().edges)
    assert trace.scene.lon.shape[-1] == 1 + place.vehicles[len(place.vehicles) // 2]
