import numpy as np
import pytest

from coverdrive.errors import StartError
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.roads.initial import EGO, InitialSettings, initial_scene


@pytest.mark.parametrize("vehicles", range(3, 8))
def test_vehicles_start_where_the_paper_says_and_never_overlap(vehicles):
    settings = InitialSettings()
    centres = settings.road().centres
    for seed in range(100):
        scene = initial_scene(settings, vehicles, np.random.default_rng(seed))
        assert scene.vehicles == vehicles + 1
        assert scene.valid.all()
        assert (scene.lon[EGO], scene.lat[EGO]) == (0.0, centres[0])
        assert (scene.length[EGO], scene.width[EGO]) == (4.8, 1.9)
        assert np.isin(scene.lat, centres).all()
        assert ((scene.lon >= -10) & (scene.lon <= 30)).all()
        assert (scene.speed == 20).all()
        assert (scene.heading == 0).all()
        assert not contacts(scene).any()


def test_gap_is_kept_within_every_lane_and_every_lane_is_used():
    settings = InitialSettings(gap=4.0)
    lanes = set()
    for seed in range(50):
        scene = initial_scene(settings, 5, np.random.default_rng(seed))
        lanes |= set(scene.lat[1:].tolist())
        for lat in settings.road().centres:
            here = np.flatnonzero(scene.lat == lat)
            order = here[np.argsort(scene.lon[here])]
            front, rear = scene.lon + scene.length / 2, scene.lon - scene.length / 2
            assert (rear[order[1:]] - front[order[:-1]] >= 4.0).all()
    assert lanes == set(settings.road().centres.tolist())


def test_sizes_vary_within_their_bounds():
    lengths = np.concatenate(
        [
            initial_scene(InitialSettings(size_variation=0.1), 7, np.random.default_rng(seed)).length[1:]
            for seed in range(50)
        ]
    )
    assert lengths.min() >= 4.8 * 0.9
    assert lengths.max() <= 4.8 * 1.1
    assert lengths.max() - lengths.min() > 4.8 * 0.18


def test_same_seed_same_scene_and_another_seed_another_scene():
    scenes = [initial_scene(InitialSettings(), 5, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert np.array_equal(scenes[0].lon, scenes[1].lon)
    assert not np.array_equal(scenes[0].lon, scenes[2].lon)


def test_too_many_vehicles_are_refused_with_a_way_out():
    with pytest.raises(StartError, match=r"20 uncontrolled vehicles.*use fewer vehicles"):
        initial_scene(InitialSettings(lanes=1), 20, np.random.default_rng(0))


def test_dense_vehicles_are_placed_one_after_the_other():
    settings = InitialSettings(behind=-60.0, ahead=100.0, gap=6.0)
    scene = initial_scene(settings, 20, np.random.default_rng(0))
    for lat in settings.road().centres:
        lon = np.sort(scene.lon[scene.lat == lat])
        assert np.diff(lon).min() > 6.0 + 4.8 * 0.95


def test_sizes_are_drawn_from_those_that_are_given():
    settings = InitialSettings(sizes=((4.0, 1.7), (12.0, 2.5)), size_variation=0.0, ahead=100.0)
    scene = initial_scene(settings, 7, np.random.default_rng(0))
    assert (scene.length[EGO], scene.width[EGO]) == (4.8, 1.9)
    assert {*zip(scene.length[1:], scene.width[1:], strict=True)} == {(4.0, 1.7), (12.0, 2.5)}


def test_the_ego_starts_beside_the_ramp_and_nobody_beyond_its_end():
    settings = InitialSettings(ramp=60.0, position=40.0, lanes=2, ahead=100.0)
    road = settings.road()
    for seed in range(20):
        assert (initial_scene(settings, 4, np.random.default_rng(seed)).lat > 3.6).all()
        scene = initial_scene(settings, 4, np.random.default_rng(seed), on_ramp=True)
        assert (scene.lon[EGO], scene.lat[EGO]) == (40.0, pytest.approx(5.4))
        assert road.has_lane(scene.lon + scene.length / 2)[np.arange(5), road.lane_at(scene.lon, scene.lat)].all()
        assert (scene.lat[scene.lon > 130] > 3.6).all()
