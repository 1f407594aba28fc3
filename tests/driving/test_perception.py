"""Slots that stay, and measured positions that are filtered as recorded ones are."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from driving_fakes import CAR, ROAD, line

import coverdrive.recordings.formats.registry  # noqa: F401  (the readers)
from coverdrive.driving.perception import Perception
from coverdrive.errors import DataError
from coverdrive.recordings.formats import registry as registry
from coverdrive.recordings.formats.reader import How, reader_of
from coverdrive.recordings.recording import SEEN
from coverdrive.recordings.tracks.filtering import seen
from coverdrive.recordings.tracks.reading import make_reading
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road
from coverdrive.simulation.traffic.replay import cut_scenarios

OWN = (0.0, 1.8, 20.0, 0.0)
SMOOTHING = SmoothingSettings()
NOISES = (SMOOTHING.position_noise, SMOOTHING.acceleration_noise)


def perception(forget: float = 0.5) -> Perception:
    return Perception(CAR, 0.1, forget, SMOOTHING)


def places(names: str) -> dict:
    """Vehicles by one letter each, each at a place of its own."""
    return {name: ((10.0 * (ord(name) - ord("a") + 1), 5.4, 20.0, 0.0), CAR) for name in names}


def who(scene) -> str:
    """The vehicles in the slots 1, 2, …, a dot where there is none."""
    return "".join(
        chr(round(lon / 10) + ord("a") - 1) if valid else "."
        for lon, valid in zip(scene.lon[1:], scene.valid[1:], strict=True)
    )


def test_vehicles_keep_their_slots_and_give_them_up_when_they_are_forgotten() -> None:
    seeing, told = perception(), ("ab", "b", "cb", "bca", "b", "b", "b", "b", "b", "bd")
    slots = [who(seeing.scene(OWN, places(names), ROAD)) for names in told]
    assert slots == ["ab", ".b", ".bc", "abc", ".b.", ".b.", ".b.", ".b.", ".b.", "db."]


def test_a_slot_is_not_given_away_before() -> None:
    seeing = perception()
    slots = [who(seeing.scene(OWN, places(names), ROAD)) for names in ("a", "", "", "", "", "b")]
    assert slots[-1] == ".b"


def test_names_are_anything_that_can_be_a_key() -> None:
    state, size = places("a")["a"]
    others = {("segment", 4): (state, size), 4: ((*state[:1], 1.8, 20.0, 0.0), size), frozenset({4}): (OWN[:2], size)}
    others[frozenset({4})] = ((-20.0, 9.0, 20.0, 0.0), size)
    assert perception().scene(OWN, others, ROAD).valid.tolist() == [True] * 4


def noisy(dt: float = 0.1) -> RawTracks:
    """Five vehicles that begin one after the other, with noise of 0.1 m, as a file of recorded tracks has them."""
    random, rows = np.random.default_rng(4), []
    for vehicle in range(5):
        moment = np.arange(5 * vehicle, 60)
        time = dt * moment
        lon = 10 + 12.0 * vehicle + 15 * time + 0.4 * vehicle * time**2 + random.normal(0, 0.1, len(moment))
        lat = 1.8 * (1 + 2 * (vehicle % 3)) + 0.5 * np.sin(time) + random.normal(0, 0.1, len(moment))
        rows.append(np.stack([np.full(len(moment), vehicle), moment, lon, lat]))
    vehicle, moment, lon, lat = np.concatenate(rows, axis=1)
    speed = 15 + 0.8 * vehicle * dt * moment
    size = np.full(len(lon), 4.5)
    return RawTracks(vehicle.astype(int), moment.astype(int), lon, lat, size, 0.4 * size, speed, 0 * moment.astype(int))


def test_measured_positions_give_the_states_that_replay_sees(tmp_path: Path) -> None:
    raw = noisy()
    recording = make_reading(tmp_path, "any", raw, 0.1, ROAD, SMOOTHING, Counter(), {}).recording
    (scenario,) = cut_scenarios([recording])
    first = round(float(recording.table["time"].min()) / 0.1)
    seeing = perception()
    for moment in range(60):
        now = np.flatnonzero(raw.moment == moment)
        others = {int(raw.vehicle[row]): ((raw.lon[row], raw.lat[row]), (4.5, 1.8)) for row in now}
        scene = seeing.scene((-500.0, 1.8, 20.0, 0.0), others, ROAD)
        if moment < first:
            assert not scene.valid[1:].any()
            continue
        replayed, there = scenario.states[moment - first], scenario.valid[moment - first]
        assert np.array_equal(scene.valid[1:], there[: len(scene.valid) - 1])
        assert np.array_equal(scene.states[1:][scene.valid[1:]], replayed[there])
    assert there.all()


@pytest.mark.real_data
def test_recorded_positions_of_us101_give_what_was_seen_of_them(us101: Path) -> None:
    file = us101 / "commonroad" / "USA_US101-10_1_T-1.xml"
    (reading,) = reader_of(file, None).read(file, How(None, SMOOTHING, None))
    road, raw, table = reading.recording.road, reading.raw, reading.recording.rates
    x, y = road.to_map(raw.lon, raw.lat)
    seeing, own, compared = perception(), (*(float(each) for each in road.to_map(-500.0, 1.8)), 20.0, 0.0), 0
    for moment in range(raw.moment.min(), raw.moment.max() + 1):
        now = np.flatnonzero(raw.moment == moment)
        scene = seeing.scene(own, {raw.vehicle[row]: ((x[row], y[row]), CAR) for row in now}, road)
        expected = table.filter((table["time"] - 0.1 * moment).abs() < 0.01).sort("seen_lon")
        states = scene.states[1:][scene.valid[1:]]
        assert states[states[:, 0].argsort()] == pytest.approx(expected.select(SEEN.names()).to_numpy(), abs=1e-5)
        compared += len(states)
    assert compared == len(table) > 2000


def test_gaps_are_bridged_and_exact_states_are_taken_as_they_are() -> None:
    seeing, x = perception(forget=3.0), 20 + 1.5 * np.arange(20) + np.random.default_rng(0).normal(0, 0.1, 20)
    measured = ~np.isin(np.arange(20), [7, 8, 9])
    for k in range(20):
        others = {"a": ((x[k], 5.4), CAR)} if measured[k] else {}
        scene = seeing.scene(OWN, others, ROAD)
    positions, speeds = seen(x, measured, np.array([0]), 0.1, NOISES)
    assert scene.lon[1] == positions[-1]
    assert scene.speed[1] == pytest.approx(speeds[-1])
    exact = seeing.scene(OWN, {"a": ((300.0, 5.4, 3.0, 0.1), CAR)}, ROAD)
    assert exact.states[1].tolist() == [300.0, 5.4, 3.0, 0.1]
    assert not seeing.scene(OWN, {"a": ((300.3, 5.4), CAR)}, ROAD).valid[1]  # measured anew


def test_positions_are_measured_in_the_map() -> None:
    turned = Road(ROAD.edges, 250.0, line(0.5))
    one, other = perception(), perception()
    for k in range(6):
        place = (20 + 1.5 * k, 5.4 + 0.05 * k)
        x, y = turned.to_map(*place)
        plain = one.scene(OWN, {"a": (place, CAR)}, ROAD)
        there = other.scene((*turned.to_map(0.0, 1.8), 20.0, 0.5), {"a": ((x, y), CAR)}, turned)
    assert there.states == pytest.approx(plain.states, abs=1e-6)
    assert there.speed[1] == pytest.approx(15, abs=0.5)


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"a": (9.0, 1.8, 20.0, 0.0)}, "vehicle 'a': got .*; expected its state and its size"),
        ({"a": (("here", 1.8), CAR)}, "vehicle 'a': got"),
        ({"a": None}, "vehicle 'a': got None"),
        ([(OWN, CAR)], "expected a dict"),
        ({"a": (OWN, (400.0, 2.0))}, "400 m long and 2 m wide; expected metres above 0, at most 100 m"),
    ],
)
def test_what_is_no_vehicle_is_named(others: object, message: str) -> None:
    with pytest.raises(DataError, match=message):
        perception().scene(OWN, others, ROAD)


def test_speeds_are_those_along_the_road_beside_a_bend() -> None:
    road = Road(ROAD.edges, 250.0, line(0.5, 1 / 100))
    x, y = (float(each) for each in road.to_map(50.0, 9.0))
    states = perception().scene((x, y, 18.2, 0.5 + 50 / 100 + 0.1), {}, road).states[0]
    later = road.to_road(x + 1e-4 * 18.2 * np.cos(1.1), y + 1e-4 * 18.2 * np.sin(1.1))
    rates = (np.array(later) - [50.0, 9.0]) / 1e-4
    assert states[2] * np.array([np.cos(states[3]), np.sin(states[3])]) == pytest.approx(rates, abs=1e-2)
    assert states[2] > 19.5


def test_who_stands_is_seen_as_it_is_turned() -> None:
    road = Road(ROAD.edges, 250.0, line(0.5))
    x, y = (float(each) for each in road.to_map(50.0, 5.4))
    scene = perception().scene(
        (*road.to_map(0.0, 1.8), 0.0, 0.6), {"wall": ((x, y, 0.0, 0.5 + 1.5), (10.0, 0.5))}, road
    )
    assert scene.states == pytest.approx(np.array([[0.0, 1.8, 0.0, 0.1], [50.0, 5.4, 0.0, 1.5]]), abs=1e-6)
