"""Drives in a simulator that is not ours are measured, drawn and replayed as our own."""

import json
from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from driving_fakes import CAR, PREDICTOR, ROAD, SETTINGS, begin, line, moved, told
from simulation_fakes import ConstantPlanner

from coverdrive.bridges.world import drive
from coverdrive.driving.driver import Driver
from coverdrive.driving.recorder import Recorder
from coverdrive.errors import DataError, SettingError
from coverdrive.planning.planner import MpcPlanner
from coverdrive.reporting.page.replay import replay_data
from coverdrive.road import Road
from coverdrive.simulation.drives.episode import run_episode
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.traffic.driver_traffic import DriverTraffic
from shape_checks import unchecked


def record(driver: Driver, seed: int) -> Trace:
    """An episode in a simulator that tells, steps and ends on its own."""
    recorder, (start, traffic) = Recorder(driver), begin(seed)
    recorder.reset()
    scene = start.scene
    for _ in range(SETTINGS.steps):
        scene = moved(scene, traffic, recorder.step(*told(scene), start.road))
    recorder.end(*told(scene))
    return recorder.trace()


@pytest.mark.parametrize("seed", [1, 4])
def test_a_recorded_drive_is_that_of_our_own_simulation(seed: int) -> None:
    own = run_episode(PREDICTOR, MpcPlanner(), DriverTraffic(), SETTINGS, 5, seed)
    recorded = record(Driver(PREDICTOR), seed)
    for mine, theirs in zip(jax.tree.leaves(own.scene), jax.tree.leaves(recorded.scene), strict=True):
        assert np.array_equal(mine, theirs)
    assert all(np.array_equal(a.states, b.states) for a, b in zip(own.plans, recorded.plans, strict=True))
    assert own.outcome == recorded.outcome
    rows = [measure(trace, seed, 0) for trace in (own, recorded)]
    different = {name for name in rows[0] if rows[0][name] != rows[1][name]}
    assert different <= {"planning_median", "planning_p99", "planning_maximum", "planning_wall_p99"}
    assert (recorded.planning_seconds >= recorded.prediction_seconds).all()


def test_the_trace_ends_with_the_first_contact_although_the_simulator_goes_on() -> None:
    recorder = Recorder(Driver(PREDICTOR, ConstantPlanner()))
    for k in range(20):
        recorder.step((3.0 * k, 1.8, 30.0, 0.0), {"ahead": ((15.5 + 2.0 * k, 1.8, 20.0, 0.0), CAR)}, ROAD)
    trace = recorder.trace()
    assert len(trace) == 11  # 10.7 m between the bumpers at 10 m/s
    assert trace.outcome == Outcome(Kind.FRONTAL, 11 * 0.1, 1, Fault.EGO)


def appearing() -> Recorder:
    """Three vehicles, of which one is always there, one comes late and one leaves."""
    recorder = Recorder(Driver(PREDICTOR, ConstantPlanner()))
    for k in range(12):
        others = {"always": ((30 + 2.0 * k, 5.4, 20.0, 0.0), CAR)}
        if k < 6:
            others["leaves"] = ((50 + 2.0 * k, 9.0, 20.0, 0.0), CAR)
        if k >= 4:
            others["comes"] = ((-30 + 2.0 * k, 9.0, 20.0, 0.0), CAR)
        recorder.step((2.0 * k, 1.8, 20.0, 0.0), others, ROAD)
    return recorder


def test_vehicles_come_and_go() -> None:
    trace = appearing().trace()
    assert len(trace) == 11
    assert trace.scene.valid.T.astype(int).tolist() == [[1] * 12, [1] * 12, [1] * 6 + [0] * 6, [0] * 4 + [1] * 8]
    assert trace.outcome == Outcome(Kind.FINISHED, 11 * 0.1, None, Fault.NONE)
    assert measure(trace, 0, 0)["vehicles"] == 2
    json.dumps(replay_data(0, trace, None))


def test_a_drive_ends_once_and_on_the_road_where_it_began() -> None:
    recorder = appearing()
    with pytest.raises(DataError, match="the road is another one than at the first step"):
        recorder.step((30.0, 1.8, 20.0, 0.0), {}, Road.straight(lanes=4))
    with pytest.raises(DataError, match="the road is another one than at the first step"):
        recorder.step((30.0, 1.8, 20.0, 0.0), {}, replace(ROAD, line=line()))
    recorder.end((24.0, 1.8, 20.0, 0.0), {})
    assert len(recorder.trace()) == 12
    with pytest.raises(DataError, match="has been ended"):
        recorder.step((26.0, 1.8, 20.0, 0.0), {}, ROAD)
    with pytest.raises(DataError, match="a drive ends once"):
        recorder.end((26.0, 1.8, 20.0, 0.0), {})
    recorder.reset()
    with pytest.raises(DataError, match="there is no drive yet"):
        recorder.trace()
    recorder.step((0.0, 1.8, 20.0, 0.0), {}, ROAD)
    assert recorder.driver.step((2.0, 1.8, 20.0, 0.0), {}, ROAD).scene.vehicles == 1


def test_a_driver_of_another_period_is_refused_before_it_drives() -> None:
    world = SimpleNamespace(car=SimpleNamespace(period=0.5))
    with unchecked(), pytest.raises(SettingError, match=r"told every 0\.5 s, the driver decides every 0\.1 s"):
        drive(world, Driver(PREDICTOR, ConstantPlanner()), 0)  # pyright: ignore[reportArgumentType]
