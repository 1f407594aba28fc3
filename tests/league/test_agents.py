"""Who keeps to the lane of the start, where it steers and when it brakes; and what IDM and MOBIL do at the wheel."""

import numpy as np
import pytest
from simulation_fakes import make_scene

from coverdrive.league.agents import Agent, AgentPlanner, Idm, IdmMobil, KeepVelocity, Witness
from coverdrive.planning.planner import PlannerSettings
from coverdrive.planning.problem.vehicle import step
from coverdrive.road import LaneEdges, Road
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.idm_mobil import DriverSettings
from coverdrive.simulation.studies.study import simulate
from coverdrive.simulation.traffic.motion import with_states

ROAD = Road.straight()


def test_it_comes_back_to_the_lane_of_the_start() -> None:
    agent, scene = KeepVelocity(), make_scene([0.0, 50.0], [4.2, 1.8], speed=[20.0, 0.0])
    assert isinstance(agent, Agent)
    agent.reset(0.1)
    for _ in range(80):
        states = scene.states
        states[0] = step(states[0], np.array(agent.act(scene, ROAD)), 0.1)
        scene = with_states(scene, states)
    assert scene.lat[0] == pytest.approx(5.4, abs=0.05) and scene.speed[0] == 20.0
    agent.reset(0.1)
    beside = make_scene([0.0], [1.8], speed=[20.0])
    assert agent.act(beside, ROAD) == (0.0, pytest.approx(0.0))


def test_idm_minds_the_nearest_ahead_in_its_lane_alone() -> None:
    agent = Idm()
    agent.reset(0.1)
    usual = DriverSettings()
    free, _ = agent.act(make_scene([0.0, -20.0, 20.0], [1.8, 1.8, 5.4], speed=[15.0, 15, 5]), ROAD)
    assert free == pytest.approx(usual.acceleration * (1 - (15 / 30) ** 4))
    scene = make_scene([0.0, 60.0, 40.0], [1.8, 1.8, 1.8], speed=[15.0, 3, 10])
    gap, closing = 40.0 - scene.half_sizes[[0, 2], 0].sum(), 5.0
    a, b = usual.acceleration, usual.deceleration
    wished = usual.minimum_gap + 15 * usual.time_gap + 15 * closing / (2 * np.sqrt(a * b))
    followed, _ = agent.act(scene, ROAD)
    assert followed == pytest.approx(a * (1 - (15 / 30) ** 4 - (wished / gap) ** 2))
    assert agent.act(make_scene([0.0, 8.0], [1.8, 1.8], speed=[30.0, 0.0]), ROAD)[0] == -8.0


THREE = Road.straight()
ONE = Road.straight(lanes=1)


def driven(others: list[tuple[float, float, float]], road: Road, seconds: float, speed: float = 25.0) -> np.ndarray:
    """States of the ego, which wants 30 m/s, among others (lon, lat, speed) that keep their velocity."""
    settings = PlannerSettings.model_validate({"problem": {"cost": {"reference_speed": 30.0}}})
    agent, state = IdmMobil(settings), np.array([0.0, 1.8, speed, 0.0])
    agent.reset(0.1)
    states = [state]
    for k in range(round(10 * seconds)):
        rows = [states[-1], *(np.array([lon + 0.1 * k * other, lat, other, 0.0]) for lon, lat, other in others)]
        lon, lat, speeds, heading = np.array(rows).T
        inputs = agent.act(make_scene(lon, lat, speeds, heading), road)
        assert -7.6 <= inputs[0] <= 4.0
        states.append(step(states[-1], np.array(inputs), 0.1))
    return np.array(states)


def test_behind_a_leader_it_keeps_its_distance() -> None:
    states = driven([(80.0, 1.8, 15.0)], ONE, 40.0)
    gap = 80.0 + 40.0 * 15 - states[-1, 0] - 4.8
    assert states[-1, 2] == pytest.approx(15.0, abs=0.2)
    assert 15 * 1.4 < gap < 15 * 1.4 + 8
    assert states[:, 1] == pytest.approx(1.8)


def test_on_the_free_road_it_drives_as_fast_as_it_wants() -> None:
    states = driven([(-200.0, 5.4, 20.0)], THREE, 60.0)
    assert states[-1, 2] == pytest.approx(30.0, abs=0.3)


def test_past_a_slow_vehicle_it_changes_lanes_within_some_seconds() -> None:
    states = driven([(60.0, 1.8, 15.0)], THREE, 12.0)
    assert states[-1, 1] == pytest.approx(5.4, abs=0.2)
    assert states[-1, 0] > 60 + 12 * 15 or states[-1, 2] > 24
    between = 0.1 * np.count_nonzero((states[:, 1] > 2.0) & (states[:, 1] < 5.2))
    assert 2.5 < between < 7.0
    assert np.abs(states[:, 3]).max() < 0.1


def test_it_stays_where_somebody_fast_comes_from_behind() -> None:
    states = driven([(60.0, 1.8, 15.0), (-25.0, 5.4, 40.0)], Road.straight(lanes=2), 2.0)
    assert states[:, 1] == pytest.approx(1.8, abs=0.05)


def test_a_lane_change_that_has_only_begun_is_given_up_for_somebody_who_appears() -> None:
    settings = PlannerSettings.model_validate({"problem": {"cost": {"reference_speed": 30.0}}})
    agent, road, state = IdmMobil(settings), Road.straight(lanes=2), np.array([0.0, 1.8, 25.0, 0.0])
    agent.reset(0.1)
    turned = []
    for k in range(12):
        appears = k >= 6
        beside = state[0] - 8.0
        scene = make_scene(
            [state[0], 60.0 + 1.5 * k, beside], [state[1], 1.8, 5.4], [state[2], 15.0, 32.0], [state[3], 0, 0]
        )
        scene = Scene(*(getattr(scene, name) for name in ("lon", "lat", "speed", "heading", "length", "width")),
                      np.array([True, True, appears]))  # fmt: skip
        inputs = agent.act(scene, road)
        turned.append(inputs[1])
        state = step(state, np.array(inputs), 0.1)
    assert max(turned[:5]) > 0.01 and turned[-1] < 0
    assert state[1] < 2.6


def test_it_leaves_a_lane_that_ends() -> None:
    spots, lat = np.array([0.0, 250.0, 300.0, 1000.0]), np.tile([0.0, 3.6, 7.2], (4, 1))
    lat[2:, 0] = 3.6
    road = Road(edges=np.array([0.0, 3.6, 7.2]), length=1000.0, changing=LaneEdges(spots, lat))
    states = driven([(20.0, 5.4, 25.0), (-15.0, 5.4, 25.0)], road, 15.0, speed=22.0)
    at_the_end = states[np.searchsorted(states[:, 0], 270.0)]
    assert at_the_end[1] > 4.5


def test_agents_drive_within_the_limits_of_the_car() -> None:
    class Wild:
        def reset(self, period: float) -> None:
            self.calls = 0

        def act(self, scene: Scene, road: Road) -> tuple[float, float]:
            self.calls += 1
            return (25.0, 3.0) if self.calls < 20 else (-25.0, 0.0)

    witness = Witness()
    trace = simulate(witness, AgentPlanner(Wild(), witness), traffic="drivers", vehicles=0, seed=0)
    inputs = np.array([plan.inputs[0] for plan in trace.plans])
    assert inputs[:, 0].min() == -8.0 and inputs[:, 0].max() <= 3.0
    assert np.abs(inputs[:, 1] * np.asarray(trace.scene.speed)[:-1, 0]).max() <= 4.0 + 1e-6
    assert trace.scene.speed[-1, 0] == 0 and np.asarray(trace.scene.speed).min() >= 0


def test_an_agent_that_says_no_numbers_is_named() -> None:
    class Lost(KeepVelocity):
        def act(self, scene: Scene, road: Road) -> tuple[float, float]:
            return np.nan, 0.0

    witness = Witness()
    with pytest.raises(ValueError, match="expected an acceleration") as caught:
        simulate(witness, AgentPlanner(Lost(), witness), traffic="drivers", seed=0)
    assert any("agent" in note and "Lost" in note for note in caught.value.__notes__)
