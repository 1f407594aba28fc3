"""A simulator that is not ours, to which ours has been made: vehicles by name, map coordinates, commands."""

from collections.abc import Iterator

import numpy as np
from simulation_fakes import FakeBasis, FakePredictor

from coverdrive.planning.problem.vehicle import step
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.driver_traffic import DriverTraffic
from coverdrive.simulation.traffic.model import Start
from coverdrive.simulation.traffic.motion import with_states

PREDICTOR = FakePredictor(FakeBasis.make(accelerations=(0.0, -2.0), shifts=(0.0,)))
ROAD = Road.straight()
CAR = (4.8, 1.9)
SETTINGS = EpisodeSettings(duration=3.0)


def told(scene: Scene) -> tuple[list[float], dict]:
    """What a driver is told of a scene in the road frame."""
    names = [slot for slot in np.flatnonzero(scene.valid).tolist() if slot != EGO]
    sizes = 2 * scene.half_sizes
    return scene.states[EGO].tolist(), {f"car {slot}": (scene.states[slot], tuple(sizes[slot])) for slot in names}


def begin(seed: int, vehicles: int = 5) -> tuple[Start, DriverTraffic]:
    """The start of an episode in reactive traffic as of `run_episode`, and the traffic."""
    random, traffic_random = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(2))
    traffic = DriverTraffic()
    start = traffic.start(SETTINGS.initial, vehicles, random)
    traffic.reset(start.scene, start.road, traffic_random)
    return start, traffic


def moved(scene: Scene, traffic: DriverTraffic, command) -> Scene:
    """The scene one step later."""
    after = traffic.step(scene, SETTINGS.step).scene
    states = after.states
    states[EGO] = step(scene.states[EGO], np.array([command.acceleration, command.yaw_rate]), SETTINGS.step)
    return with_states(after, states)


def straight_ahead(moments: int, **cars: tuple[float, float, float]) -> Iterator[dict]:
    """Others (x, y, speed) that keep lane and speed, at moments 0.1 s apart."""
    for k in range(moments):
        yield {name: ((x + 0.1 * k * speed, y, speed, 0.0), CAR) for name, (x, y, speed) in cars.items()}


def line(heading: float = 0.0, curvature: float = 0.0, length: float = 250.0) -> ReferenceLine:
    """From (100, −50) m on."""
    return ReferenceLine(np.array([100.0, -50.0]), heading, np.full(251, curvature), length)
