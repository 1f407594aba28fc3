"""SUMO through its bridge: front bumpers and angles, roads of several edges, what a command does, and who drives."""

from pathlib import Path

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor

pytest.importorskip("libsumo", reason="needs the extra sumo", exc_type=ImportError)

from coverdrive.bridges.sumo import Sumo
from coverdrive.bridges.world import drive
from coverdrive.driving.driver import Driver
from coverdrive.errors import DataError, SettingError
from coverdrive.simulation.drives.outcome import Kind

PREDICTOR = FakePredictor(FakeBasis.make(accelerations=(0.0, -2.0), shifts=(0.0,)))
UP = np.array([0.6, 0.8])
"""direction of the road"""
LEFT = np.array([-0.8, 0.6])
HEADING = np.arctan2(0.8, 0.6)


def edge(name: str, ends: tuple[float, float], lanes: int) -> str:
    """An edge of lanes of 3.5 m, between two places [m] along the road; their left edge is that of the road."""
    rows = []
    for index in range(lanes):
        first, last = (UP * end - LEFT * 3.5 * (lanes - 0.5 - index) for end in ends)
        shape = f"{first[0]},{first[1]} {last[0]},{last[1]}"
        length = ends[1] - ends[0]
        row = f'<lane id="{name}_{index}" index="{index}" speed="30" length="{length}" width="3.5" shape="{shape}"/>'
        rows.append(row)
    return "".join(rows)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A road in two edges, the second of which has a lane less on the right, and a demand."""
    (tmp_path / "net.xml").write_text(
        f"""<net version="1.20">
        <edge id="first" from="a" to="b" priority="1">{edge("first", (0.0, 500.0), 3)}</edge>
        <edge id="second" from="b" to="c" priority="1">{edge("second", (500.0, 900.0), 2)}</edge>
        <junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 1,1"/>
        <junction id="b" type="priority" x="300" y="400" incLanes="first_0 first_1 first_2" intLanes=""
            shape="300,400 301,401">
            <request index="0" response="00" foes="00" cont="0"/>
            <request index="1" response="00" foes="00" cont="0"/>
        </junction>
        <junction id="c" type="dead_end" x="540" y="720" incLanes="second_0 second_1" intLanes=""
            shape="540,720 541,721"/>
        <connection from="first" to="second" fromLane="1" toLane="0" dir="s" state="M"/>
        <connection from="first" to="second" fromLane="2" toLane="1" dir="s" state="M"/>
        </net>"""
    )
    (tmp_path / "demand.xml").write_text(
        """<routes>
        <vType id="own" length="5" width="2"/>
        <vType id="truck" vClass="truck" length="12" width="2.5" maxSpeed="15" lcKeepRight="0"/>
        <vType id="car" length="4" width="1.8" speedFactor="normc(1,0.1,0.8,1.2)"/>
        <route id="all" edges="first second"/>
        <vehicle id="truck" type="truck" route="all" depart="0" departLane="1" departSpeed="10"/>
        <flow id="cars" type="car" route="all" begin="0" end="60" vehsPerHour="1500" departLane="random"/>
        <vehicle id="ego" type="own" route="all" depart="6" departLane="1" departSpeed="10"/>
        </routes>"""
    )
    return tmp_path


def world(folder: Path, seed: int = 1, ego: str = "ego") -> Sumo:
    made = Sumo(["-n", str(folder / "net.xml"), "-r", str(folder / "demand.xml"), "--lanechange.duration", "3"], ego)
    made.reset(seed)
    return made


def test_places_are_those_of_centres(folder: Path) -> None:
    """The ego departs with its back bumper at the beginning of the middle lane."""
    there = world(folder)
    assert there.car == (5.0, 2.0, 0.1)
    own, others, road = there.observe()
    assert road.edges == pytest.approx([0, 3.5, 7, 10.5], abs=1e-3)
    assert road.length == pytest.approx(900, abs=0.1)
    assert road.has_lane(np.array([10.0, 890.0])).tolist() == [[True] * 3, [False, True, True]]
    assert own == pytest.approx((*(2.6 * UP - 5.25 * LEFT), 10.0, HEADING), abs=1e-3)
    assert np.array(road.to_road(*own[:2])) == pytest.approx([2.6, 5.25], abs=1e-3)
    (x, y, _, heading), size = others["truck"]
    assert size == (12.0, 2.5)
    assert heading == pytest.approx(HEADING, abs=0.01)
    front = x + 6 * np.cos(heading), y + 6 * np.sin(heading)
    assert front == pytest.approx(there._sumo.vehicle.getPosition("truck"), abs=1e-3)


@pytest.mark.parametrize(("acceleration", "yaw_rate"), [(-4.0, 0.0), (1.0, 0.05), (2.0, -0.05)])
def test_what_is_commanded_happens(folder: Path, acceleration: float, yaw_rate: float) -> None:
    there = world(folder)
    steering = Driver(PREDICTOR, ConstantPlanner(acceleration, yaw_rate))
    for _ in range(4):
        before = there.observe().own
        there.apply(steering.step(*there.observe()))
        after = there.observe().own
        assert after[2:] == pytest.approx((before[2] + 0.1 * acceleration, before[3] + 0.1 * yaw_rate))
        assert there._state("ego") == pytest.approx((*after[:2], (before[2] + after[2]) / 2, after[3]), abs=0.01)
        assert np.hypot(after[0] - before[0], after[1] - before[1]) == pytest.approx(
            0.05 * (before[2] + after[2]), 1e-3
        )


def test_others_mind_the_ego(folder: Path) -> None:
    """It stops in the middle lane, and SUMO's vehicles get by."""
    there = world(folder)
    braking, standing = Driver(PREDICTOR, ConstantPlanner(-4.0)), Driver(PREDICTOR, ConstantPlanner())
    behind, passed = set[object](), set[object]()
    for k in range(175):
        own, others, road = there.observe()
        there.apply((braking if k < 25 else standing).step(own, others, road))
        ahead = {name: road.to_road(*state[:2])[0] > road.to_road(*own[:2])[0] for name, (state, _) in others.items()}
        passed |= {name for name in behind if ahead.get(name)}
        behind |= {name for name in ahead if not ahead[name]}
    assert own[2] == pytest.approx(0.0, abs=1e-6)
    assert len(passed) >= 2
    assert not there.crashed


def test_the_same_seed_is_the_same_drive_and_it_ends_where_the_road_does(folder: Path) -> None:
    there = world(folder)
    ours = Driver(PREDICTOR, wanted_speed=30.0, **there.car._asdict())
    first, second, other = (drive(there, ours, seed, duration) for seed, duration in ((1, None), (1, 5.0), (2, 5.0)))
    assert first.outcome.kind is Kind.FINISHED
    assert first.scene.lon[-1, 0] == pytest.approx(900, abs=12)
    vehicles = second.scene.vehicles
    assert np.array_equal(first.scene.states[:51, :vehicles], second.scene.states)
    assert not np.array_equal(second.scene.speed[-1, 0], other.scene.speed[-1, 0])


def test_who_drives_on_runs_into_others(folder: Path) -> None:
    there = world(folder)
    trace = drive(there, Driver(PREDICTOR, ConstantPlanner(2.0)), 1)
    assert trace.outcome.kind is Kind.FRONTAL
    assert there.crashed and there.done


def test_its_own_driver_drives_when_nobody_else_does(folder: Path) -> None:
    there = world(folder)
    speeds = []
    while not there.done:
        there.apply(None)
        speeds.append(there.observe().own[2])
    assert not there.crashed
    assert max(speeds) > 20


def test_who_looks_before_the_first_reset_is_told_to_reset(folder: Path) -> None:
    libsumo = pytest.importorskip("libsumo")
    if libsumo.isLoaded():
        libsumo.close()
    with pytest.raises(SettingError, match="no drive has begun; reset the world first"):
        Sumo(["-n", str(folder / "net.xml")], "ego").observe()


def test_there_has_to_be_an_ego(folder: Path) -> None:
    with pytest.raises(DataError, match="no vehicle 'me' has departed"):
        world(folder, ego="me")
