"""highway-env through its bridge: left and right, sizes, what a command does, and who drives."""

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor

pytest.importorskip("highway_env", reason="needs the extra highway-env")

from coverdrive.bridges.highway_env import HighwayEnv
from coverdrive.bridges.world import drive
from coverdrive.driving.driver import Driver
from coverdrive.errors import DataError
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.measures.metrics import gaps

PREDICTOR = FakePredictor(FakeBasis.make(accelerations=(0.0, -2.0), shifts=(0.0,)))


def world(seed: int = 3, **config) -> HighwayEnv:
    made = HighwayEnv(**{"lanes_count": 3, "vehicles_count": 6, "duration": 6, **config})
    made.reset(seed)
    return made


def driver(of: HighwayEnv, **inputs: float) -> Driver:
    return Driver(PREDICTOR, ConstantPlanner(**inputs), period=of.car.period)


@pytest.mark.parametrize("lane", [0, 2])
def test_lanes_are_mirrored(lane: int) -> None:
    """Lane 0 of highway-env is the leftmost one; lanes are 4 m wide."""
    own, others, road = world(initial_lane_id=lane).observe()
    assert road.edges.tolist() == [-10, -6, -2, 2]
    assert road.lane_of(np.array(own[1])) == 2 - lane
    assert road.speed_limit == 30
    assert len(others) == 6
    assert {size for _, size in others.values()} == {(5.0, 2.0)}


@pytest.mark.parametrize("frequency", [10, 30])
@pytest.mark.parametrize(("acceleration", "yaw_rate"), [(-8.0, 0.0), (2.0, 0.08), (-3.0, -0.15)])
def test_what_is_commanded_happens(acceleration: float, yaw_rate: float, frequency: int) -> None:
    there = world(simulation_frequency=frequency, initial_lane_id=1)
    steering = driver(there, acceleration=acceleration, yaw_rate=yaw_rate)
    for _ in range(3):
        x, y, speed, heading = there.observe().own
        there.apply(steering.step(*there.observe()))
        after = there.observe().own
        assert after[2] == pytest.approx(speed + 0.1 * acceleration)
        assert after[3] == pytest.approx(heading + 0.1 * yaw_rate)
        assert after[0] == pytest.approx(x + 0.1 * (speed + after[2]) / 2, abs=0.06)  # it is moved by Euler's method
        assert after[1] - y == pytest.approx(0.1 * speed * (heading + 0.05 * yaw_rate), abs=0.06)


def test_others_are_told_as_they_move() -> None:
    """Sideways, too: where they will be a moment later."""
    there = world(seed=5, vehicles_count=15, vehicles_density=2.0)
    sideways = []
    for _ in range(60):
        before = there.observe().others
        there.apply(None)
        after = there.observe().others
        for name in before.keys() & after.keys():
            (x, y, speed, heading), _ = before[name]
            moved = np.array(after[name][0][:2]) - (x, y)
            assert moved[0] == pytest.approx(0.1 * speed * np.cos(heading), abs=0.3)
            sideways.append((moved[1], 0.1 * speed * np.sin(heading)))
    sideways = np.array(sideways)
    assert np.abs(sideways).max() > 0.1
    assert np.corrcoef(sideways.T)[0, 1] > 0.8


def test_the_same_seed_is_the_same_drive() -> None:
    there = world(duration=3)
    ours = Driver(PREDICTOR, wanted_speed=30.0, **there.car._asdict())
    first, second, other = (drive(there, ours, seed) for seed in (3, 3, 4))
    assert first.outcome.kind is Kind.FINISHED
    assert first.outcome.time == pytest.approx(3.0, abs=0.11)
    assert np.array_equal(first.scene.states, second.scene.states)
    assert not np.array_equal(first.scene.states[0], other.scene.states[0])


def test_who_drives_on_runs_into_others() -> None:
    there = world(duration=40)
    trace = drive(there, driver(there, acceleration=3.0), 3)
    assert there.crashed and there.done  # as soon as they would be in contact a step later
    assert gaps(trace).min() < 1.5


def test_its_own_driver_drives_when_nobody_else_does() -> None:
    there = world(seed=0, duration=6, vehicles_count=30)
    accelerations = set[float]()
    while not there.done:
        before = there.observe().own
        there.apply(None)
        accelerations.add(round(there.observe().own[2] - before[2], 6))
    assert not there.crashed
    assert len(accelerations) > 30  # it minds the others
    there.reset(0)
    assert there.observe().own[2] == 25.0


def test_other_roads_are_refused() -> None:
    with pytest.raises(DataError, match="not one straight road along x"):
        HighwayEnv("racetrack-v1")
    with pytest.raises(DataError, match=r"merge-v1 cannot be made .* one straight road along x, as highway-v0"):
        HighwayEnv("merge-v1")


def test_who_looks_before_the_first_reset_sees_the_road() -> None:
    assert HighwayEnv("highway-v0", lanes_count=2, vehicles_count=1).observe().road.lanes == 2
