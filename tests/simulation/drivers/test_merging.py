"""Drivers leave a lane that ends, and are let in; nobody is touched, nobody leaves the road."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fakes import make_scene

from coverdrive.geometry import turned_half_extents
from coverdrive.simulation.drivers import freeway
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drivers.idm_mobil import FREE, Drivers, Neighbours, follow
from coverdrive.simulation.drivers.merging import HARSHEST, SHORTEST_GAP, accepts, in_haste, stopping
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.roads.initial import InitialSettings
from coverdrive.simulation.roads.settings import CURVED, RoadSettings
from coverdrive.simulation.traffic.driver_traffic import AggressiveTrafficSettings, DriverTraffic, DriverTrafficSettings

RAMP = RoadSettings(lanes=1, ramp=300.0).road_of(1000.0)
CALM = DriverTrafficSettings(moody_share=0.0, wander=0.0)
DRIVER = Drivers(*(np.array([[value] * 3]) for value in (25.0, 1.4, 2.0, 1.4, 2.0, 0.3, 0.1, 1.5)))


def drive(traffic, scene, road, seed, steps, dt=0.1):
    """All vehicles as drivers, that of the ego's slot included."""
    traffic.reset(scene, road, np.random.default_rng(seed), np.ones(scene.vehicles, dtype=bool))
    scenes = [scene]
    for _ in range(steps):
        scenes.append(traffic.step(scenes[-1], dt).scene)
    return scenes


def beyond_the_edges(scene, road):
    aside = turned_half_extents(scene.half_sizes, scene.heading)[..., 1]
    edges = road.edges_at(scene.lon)
    return (scene.lat - aside < edges[..., 0]) | (scene.lat + aside > edges[..., -1])


def never(hasty, speed, target):
    """Accepts no gap."""
    return np.zeros(speed.shape, dtype=bool)


def test_whoever_is_pressed_accepts_less() -> None:
    hasty = in_haste(DRIVER, np.array([[0.0, 0.5, 1.0]]))
    assert hasty.time_gap[0] == pytest.approx([1.4, 0.98, SHORTEST_GAP])
    assert hasty.safe_deceleration[0] == pytest.approx([1.5, 2.75, HARSHEST])
    speed, slot = np.full((1, 3), 20.0), np.zeros((1, 3), dtype=int)
    for gap, expected in ((40.0, [True, True, True]), (12.0, [False, False, True]), (1.0, [False, False, False])):
        lone = np.full((1, 3), FREE)
        for ahead, behind in ((gap, FREE), (FREE, gap)):
            target = Neighbours(slot, np.full((1, 3), ahead), slot, np.full((1, 3), behind))
            assert accepts(hasty, speed, target).tolist() == [expected]
        assert accepts(hasty, speed, Neighbours(slot, lone, slot, lone)).all()


def test_the_end_of_a_lane_is_stopped_at_no_earlier_than_needed() -> None:
    room, speed = np.array([[200.0, 100.0, 50.0]]), np.full((1, 3), 20.0)
    assert stopping(room, speed, DRIVER)[0] == pytest.approx([np.inf, np.inf, -4.0])


def test_a_lone_driver_merges_before_the_end_without_braking() -> None:
    scene = make_scene([0.0], [1.8], speed=[20.0])
    scenes = drive(DriverTraffic(CALM), scene, RAMP, 0, 200)
    lon, lat = (np.array([getattr(each, name)[0] for each in scenes]) for name in ("lon", "lat"))
    assert lat[lon > 200.0][0] == pytest.approx(5.4, abs=0.05)
    assert min(np.diff([each.speed[0] for each in scenes])) > -0.02
    assert not any(beyond_the_edges(each, RAMP).any() for each in scenes)


def test_without_a_gap_a_driver_stops_at_the_end_and_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(freeway, "accepts", never)
    blocked = replace(
        make_scene([150.0, 300.0, 320.0], [1.8, 5.4, 5.4], speed=[20.0, 0.0, 0.0]), length=np.full(3, 19.0)
    )
    scenes = drive(DriverTraffic(replace_desires(CALM)), blocked, RAMP, 0, 250)
    assert scenes[-1].speed[0] < 0.1
    assert 290.0 < scenes[-1].lon[0] + 9.5 < 309.0 and scenes[-1].lat[0] == 1.8
    assert np.diff([each.speed[0] for each in scenes]).min() > -0.4


def replace_desires(settings: DriverTrafficSettings) -> DriverTrafficSettings:
    """Drivers who hardly move by themselves, but stop from 20 m/s."""
    return settings.model_copy(update={"drivers": settings.drivers.model_copy(update={"acceleration": 0.2})})


def test_those_in_the_next_lane_open_a_gap_and_impolite_ones_do_not() -> None:
    """Beside the end of the ramp a driver slows down, with nobody ahead in the own lane."""

    def slowest(politeness: float) -> float:
        drivers = CALM.drivers.model_copy(update={"politeness": politeness, "spread": 0.0})
        traffic = DriverTraffic(CALM.model_copy(update={"drivers": drivers}))
        scene = make_scene([206.0, 200.0], [1.8, 5.4], speed=[18.0, 18.0])
        traffic.reset(scene, RAMP, np.random.default_rng(0), np.array([True, True]))
        return float(traffic.step(scene, 0.1).scene.speed[1])

    assert slowest(0.3) < 17.95 and slowest(0.0) > 18.0


def test_drivers_give_way_to_an_ego_on_the_ramp_too() -> None:
    traffic, scene = DriverTraffic(CALM), make_scene([206.0, 200.0], [1.8, 5.4], speed=[18.0, 18.0])
    traffic.reset(scene, RAMP, np.random.default_rng(0))
    moved = traffic.step(scene, 0.1).scene
    assert moved.speed[1] < 17.95 and moved.lon[0] == 206.0


def test_accepted_time_gaps_relax() -> None:
    traffic = DriverTraffic(CALM)
    drive(traffic, make_scene([200.0, 180.0], [1.8, 5.4], speed=[20.0, 20.0]), RAMP, 0, 10)
    state = traffic._freeway
    short = state.drivers.time_gap.copy()
    assert (short < state.usual_gap).all()
    for _ in range(600):
        state.advance(0.1)
    assert state.drivers.time_gap == pytest.approx(state.usual_gap, rel=0.1)
    expected = follow(state.drivers, state.speed, np.full((1, 2), FREE), state.speed)
    assert np.isfinite(expected).all()


def statistics(seeds, settings, steps):
    """Contacts, moments off the road, changes into the ramp, and vehicles that began on it, left it, stand on it."""
    start = InitialSettings(**CURVED.model_dump(), position=500.0, road_length=2000.0)
    counted = np.zeros(6, dtype=int)
    for seed in seeds:
        traffic, random = DriverTraffic(settings), np.random.default_rng(seed)
        begun = traffic.start(start, 8 + seed % 5, random)
        scenes = drive(traffic, begun.scene, begun.road, seed, steps)
        on = np.array([begun.road.lane_at(each.lon, each.lat) == 0 for each in scenes])
        touched = np.logical_or.reduce([contacts(each) for each in scenes])
        off = sum(int(beyond_the_edges(each, begun.road).sum()) for each in scenes)
        into = int((on[1:] & ~on[:-1]).sum())
        standing = on[-1] & (scenes[-1].speed < 0.5)
        counted += [touched.sum() // 2, off, into, on[0].sum(), (on[0] & ~on[-1]).sum(), standing.sum()]
    return dict(zip(("contacts", "off", "into", "began", "left", "standing"), counted.tolist(), strict=True))


@pytest.mark.parametrize(
    "settings", [DriverTrafficSettings(), AggressiveTrafficSettings()], ids=["drivers", "aggressive"]
)
def test_all_merge_and_nobody_is_touched(settings: DriverTrafficSettings) -> None:
    found = statistics(range(2), settings, 150)
    assert found["began"] > 2 and found["left"] == found["began"]
    assert (found["contacts"], found["off"], found["into"], found["standing"]) == (0, 0, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings", [DriverTrafficSettings(), AggressiveTrafficSettings()], ids=["drivers", "aggressive"]
)
def test_merges_over_many_seeds(settings: DriverTrafficSettings) -> None:
    found = statistics(range(100, 128), settings, 300)
    assert found["began"] > 56 and found["left"] == found["began"]
    assert (found["contacts"], found["off"], found["into"], found["standing"]) == (0, 0, 0, 0)


def test_without_mandatory_changes_vehicles_strand(monkeypatch: pytest.MonkeyPatch) -> None:
    """The control of the statistics: they would see it."""
    monkeypatch.setattr(freeway, "accepts", never)
    found = statistics(range(2), DriverTrafficSettings(), 150)
    assert found["left"] < found["began"] and found["standing"] > 0


@pytest.mark.slow
def test_generated_recordings_of_merges_are_traffic_without_contacts() -> None:
    """20 scenes of 60 s; the flow behind the ramp is about that of the same road without one."""

    def flow(recording):
        table = recording.table
        lon, time, vehicle = (table[name].to_numpy() for name in ("lon", "time", "vehicle"))
        crosses = (lon[:-1] < 900) & (lon[1:] >= 900) & (np.diff(vehicle) == 0)
        times = np.sort(time[1:][crosses])
        return (len(times) - 1) / np.ptp(times) if len(times) > 10 else np.nan

    flows = []
    for road in (CURVED, CURVED.model_copy(update={"ramp": 0.0})):
        recordings = generate(GeneratedSettings(scenes=20, duration=60.0, **road.model_dump()), seed=4)
        for recording in recordings:
            table = recording.table
            scene = recording.frames().scene
            assert not contacts(scene).any()
            assert table["speed"].min() >= 0
            lane = recording.road.lane_at(table["lon"].to_numpy(), table["lat"].to_numpy())
            same = np.diff(table["vehicle"].to_numpy()) == 0
            if road.ramp:
                assert not ((np.diff(lane == 0) & (lane[1:] == 0)) & same).any()
        flows.append(np.nanmean([flow(each) for each in recordings]))
    assert flows[0] > 0.85 * flows[1]
