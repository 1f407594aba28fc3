import numpy as np
import pytest

from coverdrive.config import Experiment
from coverdrive.distances import kept
from coverdrive.recordings.recording import Recording
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.roads.initial import initial_scene
from coverdrive.simulation.roads.places import PLACES, Place, recorded_place
from coverdrive.simulation.roads.settings import RoadSettings

BENT = RoadSettings(lanes=2, lane_width=3.5, curvature=((0.0, 0.002), (600.0, 0.002)), ramp=200.0, speed_limit=30.0)


@pytest.fixture(scope="module")
def recordings() -> tuple[Recording, ...]:
    dense = {"scenes": 3, "duration": 5.0, "vehicles": (20, 20), "speed": (15.0, 17.0), "truck_share": 0.3}
    return generate(GeneratedSettings(**dense, **BENT.model_dump()))


def test_the_place_of_the_paper_is_the_default() -> None:
    assert Experiment().updated(PLACES["paper"].parts) == Experiment()
    curved = Experiment().updated(PLACES["curved"].parts)
    assert curved.updated(PLACES["paper"].parts) == Experiment()
    assert curved.episode.initial.road().line is not None
    assert curved.planner.problem.cost.reference_speed == curved.episode.initial.speed_limit


def test_a_place_is_like_what_was_recorded(recordings: tuple[Recording, ...]) -> None:
    place = recorded_place(recordings)
    start = place.initial
    assert (start.lanes, start.lane_width, start.speed_limit, start.ramp) == (2, 3.5, 30.0, 0.0)
    road = start.road()
    assert road.curvature(np.arange(0.0, start.road_length, 10.0)) == pytest.approx(0.002, abs=1e-5)
    speed = np.concatenate([each.table["speed"].to_numpy() for each in recordings])
    assert start.traffic_speed == start.ego_speed == pytest.approx(np.median(speed), abs=0.1)
    assert start.traffic_speed <= place.wanted_speed <= speed.max()
    assert start.desired_speed == place.wanted_speed
    assert start.road_length > start.position + 20 * place.wanted_speed


def test_density_and_sizes_are_those_of_the_recordings(recordings: tuple[Recording, ...]) -> None:
    place = recorded_place(recordings)
    start = place.initial
    sizes = np.array(start.sizes)
    trucks = np.mean([(each.table["length"] > 7).mean() for each in recordings])
    assert (sizes[:, 0] > 7).mean() == pytest.approx(trucks, abs=0.1)
    assert (np.diff(sizes[:, 0]) >= 0).all()
    middle = place.vehicles[len(place.vehicles) // 2]
    spacing = (start.ahead - start.behind) * start.lanes / middle
    lon = [np.sort(np.asarray(each.scene_at(2.0).lon)) for each in recordings]
    assert spacing == pytest.approx(np.mean([np.ptp(each) / (len(each) / 3) for each in lon]), rel=0.5)
    scenes = [initial_scene(start, place.vehicles[-1], np.random.default_rng(seed)) for seed in range(4)]
    assert 0.05 < np.mean([scene.length[1:] > 7 for scene in scenes]) < 0.6
    for scene in scenes:
        assert not contacts(scene).any()
        assert scene.lon.min() >= 0
        assert (scene.length[0], scene.width[0]) == (4.8, 1.9)


def test_a_vehicle_on_its_own_is_a_place_too(recordings: tuple[Recording, ...]) -> None:
    first = recordings[0]
    alone = first.table.filter(first.table["vehicle"] == first.table["vehicle"][0])
    place = recorded_place([Recording("alone", alone, first.dt, first.road, {})])
    assert place.vehicles == (1,)
    assert place.wanted_speed == pytest.approx(alone["speed"].quantile(0.95), abs=0.1)


def test_it_is_stored_as_json(recordings: tuple[Recording, ...]) -> None:
    place = recorded_place(recordings)
    assert Place.model_validate_json(place.model_dump_json()) == place
    applied = Experiment().updated(place.parts)
    assert applied.episode.initial == place.initial and applied.study.vehicles == place.vehicles


def test_a_straight_recording_makes_a_straight_road() -> None:
    (recording,) = generate(GeneratedSettings(scenes=1, duration=2.0, lanes=4, lane_width=3.3))
    start = recorded_place([recording]).initial
    assert (start.lanes, start.lane_width, start.curvature, start.speed_limit) == (4, 3.3, (), 120.0)


def test_manners_are_what_recorded_drivers_keep_in_nine_of_ten_moments(recordings: tuple[Recording, ...]) -> None:
    manners, moments = recorded_place(recordings).manners, []
    for each in recordings:
        for time in np.arange(each.table["time"].min(), each.table["time"].max() - 0.05, 1.0):
            scene = each.scene_at(time)
            alone = Scene(*(values[None] for values in vars(scene).values()))
            moments.append(kept(alone, each.road, np.arange(scene.vehicles)).headway.ravel())
    headways = np.concatenate(moments)
    assert manners is not None and manners.like == "human"
    assert manners.headway == pytest.approx(np.quantile(headways[np.isfinite(headways)], 0.1), abs=0.01)
    fastest = [
        np.abs(track["speed"].to_numpy() * np.sin(track["heading"].to_numpy())).max()
        for each in recordings
        for track in each.table.partition_by("vehicle", "group")
        if len(set(each.road.lane_at(track["lon"].to_numpy(), track["lat"].to_numpy()).tolist())) > 1
    ]
    assert manners.sideways == pytest.approx(np.quantile(fastest, 0.9), abs=0.01)
    assert "like" not in recorded_place(recordings).parts["planner"]["manners"]  # whose manners is the user's choice
