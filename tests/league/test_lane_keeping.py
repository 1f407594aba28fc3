"""Who keeps to the lane of the start: where it steers, and when it brakes."""

import numpy as np
import pytest
from simulation_fakes import make_scene

from coverdrive.league.agents import Agent
from coverdrive.league.lane_keeping import Idm, KeepVelocity
from coverdrive.planning.vehicle import step
from coverdrive.road import Road
from coverdrive.simulation.motion import with_states

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
    usual = agent._driver
    free, _ = agent.act(make_scene([0.0, -20.0, 20.0], [1.8, 1.8, 5.4], speed=[15.0, 15, 5]), ROAD)
    assert free == pytest.approx(float(usual.acceleration[0]) * (1 - (15 / 30) ** 4))
    scene = make_scene([0.0, 60.0, 40.0], [1.8, 1.8, 1.8], speed=[15.0, 3, 10])
    gap, closing = 40.0 - scene.half_sizes[[0, 2], 0].sum(), 5.0
    a, b = float(usual.acceleration[0]), float(usual.deceleration[0])
    wished = float(usual.minimum_gap[0]) + 15 * float(usual.time_gap[0]) + 15 * closing / (2 * np.sqrt(a * b))
    followed, _ = agent.act(scene, ROAD)
    assert followed == pytest.approx(a * (1 - (15 / 30) ** 4 - (wished / gap) ** 2))
    assert agent.act(make_scene([0.0, 8.0], [1.8, 1.8], speed=[30.0, 0.0]), ROAD)[0] == -8.0
