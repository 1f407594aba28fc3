"""Traffic of IDM and MOBIL drivers who react to the ego (`coverdrive.simulation.drivers.idm_mobil`).

Unlike the paper's traffic it knows nothing of the predictor, so that predictions can miss. The ego, and every
vehicle that another model moves, is to these drivers one more vehicle in the lanes that its body is in.
"""

from typing import Annotated, Literal

import numpy as np
from jaxtyping import Bool
from pydantic import Field

from coverdrive.geometry import turned_extents
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import InOrder, Settings
from coverdrive.simulation.drivers.freeway import DECISION, Freeway
from coverdrive.simulation.drivers.idm_mobil import TRUCK_LENGTH, TRUCK_PACE, DriverSettings, draw_drivers
from coverdrive.simulation.roads.course import Course
from coverdrive.simulation.roads.initial import EGO, InitialSettings, initial_scene
from coverdrive.simulation.traffic.model import Start, TrafficStep
from coverdrive.simulation.traffic.motion import with_states

_USUAL_SPEED = 20.0
"""[m/s] at the experiment's start"""

_Seconds = Annotated[float, Field(ge=0.1, le=60)]
ChangeDuration = Annotated[tuple[_Seconds, _Seconds], InOrder]


class DriverTrafficSettings(Settings):
    """Drivers by IDM and MOBIL, at the speeds of the experiment's start but farther apart than the paper's."""

    kind: Literal["drivers"] = "drivers"
    """name of this traffic"""
    drivers: DriverSettings = DriverSettings(desired_speed=25.0)
    """how people drive; a desired speed a little above the 20 m/s at which they start"""
    behind: float = Field(default=-60.0, ge=-10_000, le=10_000)
    """[m] lon of the rearmost vehicle at the start, relative to the ego"""
    ahead: float = Field(default=100.0, ge=-10_000, le=10_000)
    """[m] lon of the foremost vehicle at the start, relative to the ego"""
    gap: float = Field(default=12.0, ge=0, le=1000)
    """[m] least bumper-to-bumper distance in a lane at the start if it is at 20 m/s: 0.6 s, as at other speeds. At the
    paper's 2 m these drivers would brake as hard as they can"""
    change_duration: ChangeDuration = (4.0, 6.0)
    """[s] shortest and longest lane change (Toledo & Zohar 2007: 4.6 s on average)"""
    pause: float = Field(default=5.0, ge=0, le=3600)
    """[s] a driver stays in a lane at least"""
    moody_share: float = Field(default=0.15, ge=0, le=1)
    """share of drivers who slow down now and then without a reason, by up to 70 % of their speed"""
    mood_pause: float = Field(default=12.0, gt=0, le=1e6)
    """[s] between two such whims on average"""
    mood_braking: float = Field(default=1.0, gt=0, le=15)
    """[m/s²] how fast a moody driver's desired speed falls"""
    wander: float = Field(default=0.15, ge=0, le=0.3)
    """[m] largest amplitude of the lateral motion within the lane"""


class AggressiveTrafficSettings(DriverTrafficSettings):
    """The same with tailgating, cut-ins that force others to brake hard, and sudden braking; fits 12 vehicles."""

    kind: Literal["aggressive"] = "aggressive"  # pyright: ignore[reportIncompatibleVariableOverride]
    """name of this traffic"""
    drivers: DriverSettings = DriverSettings(
        desired_speed=27.0,
        time_gap=0.6,
        acceleration=3.0,
        deceleration=5.0,
        politeness=0.0,
        threshold=0.0,
        safe_deceleration=8.0,
        spread=0.25,
    )
    """selfish drivers (politeness 0, Kesting et al. 2007) who accept to be the reason for full braking"""
    gap: float = Field(default=6.0, ge=0, le=1000)
    """[m] least bumper-to-bumper distance in a lane at the start if it is at 20 m/s"""
    change_duration: ChangeDuration = (2.0, 3.5)
    """[s] shortest and longest lane change"""
    pause: float = Field(default=1.0, ge=0, le=3600)
    """[s] a driver stays in a lane at least"""
    moody_share: float = Field(default=0.5, ge=0, le=1)
    """share of drivers who brake now and then without a reason"""
    mood_pause: float = Field(default=6.0, gt=0, le=1e6)
    """[s] between two such whims on average"""
    mood_braking: float = Field(default=6.0, gt=0, le=15)
    """[m/s²] how fast a moody driver's desired speed falls"""


class DriverTraffic:
    """Uncontrolled vehicles that follow, brake and change lanes as drivers do."""

    def __init__(self, settings: DriverTrafficSettings | None = None):
        """Call `reset` before the first step."""
        self._settings = settings or DriverTrafficSettings()
        self._usual = self._settings.drivers

    def start(self, settings: InitialSettings, vehicles: int, rng: np.random.Generator) -> Start:
        """Vehicles in lanes, far enough apart for drivers, who want the speed of the road if it has one."""
        own = self._settings
        gap = own.gap * settings.traffic_speed / _USUAL_SPEED
        spread = settings.model_copy(update={"behind": own.behind, "ahead": own.ahead, "gap": gap})
        wanted = settings.desired_speed or own.drivers.desired_speed
        self._usual = own.drivers.model_copy(update={"desired_speed": wanted})
        return Start(initial_scene(spread, vehicles, rng, on_ramp=True), spread.road(), np.inf)

    def reset(
        self, scene: Scene, road: Road, rng: np.random.Generator, controlled: Bool[np.ndarray, " A"] | None = None
    ) -> None:
        """Begin with every vehicle in the middle of its lane, on a road of equal lanes whose right edge is at lat = 0.

        Lanes may begin and end, and the road may bend (`coverdrive.simulation.roads.settings`).

        ``controlled`` are the slots that this model moves, if not all but the ego's.
        """
        self._road, self._rng = road, rng
        self._controlled = np.arange(scene.vehicles) != EGO if controlled is None else controlled
        self._others = np.flatnonzero(~self._controlled)
        self._lane_width = float(road.edges[1] - road.edges[0])
        self._age = 0.0
        settings, shape = self._settings, (1, scene.vehicles)
        drivers = draw_drivers(self._usual, rng, shape)
        drivers.desired_speed[0, scene.length >= TRUCK_LENGTH] *= TRUCK_PACE
        lon, lane = np.array(scene.lon)[None], road.lane_at(scene.lon, scene.lat)[None]
        wave = rng.uniform(150, 400, shape)
        self._freeway = Freeway(
            course=Course(road),
            drivers=drivers,
            moody=rng.random(shape) < settings.moody_share,
            length=np.array(scene.length)[None],
            width=np.array(scene.width)[None],
            valid=np.array(scene.valid)[None],
            lon=lon,
            speed=np.array(scene.speed)[None],
            lane=lane,
            change_duration=rng.uniform(*settings.change_duration, shape),
            wander=np.stack([rng.uniform(0, settings.wander, shape), wave, -2 * np.pi * lon / wave], axis=-1),
            pause=settings.pause,
            ease=settings.mood_braking,
        )

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Let every driver decide now and then, and drive."""
        freeway = self._freeway
        self._see(scene)
        freeway.change_desires(self._rng, dt, self._settings.mood_pause)
        if self._age <= 0:
            freeway.change_lanes()
            self._age = DECISION
        self._age -= dt
        freeway.advance(dt)
        states = freeway.states(self._lane_width)[0]
        moved = np.where((self._controlled & scene.valid)[:, None], states, scene.states)
        return TrafficStep.without_bases(with_states(scene, moved))

    def _see(self, scene: Scene) -> None:
        """Put those whom others move where they are; they hold every lane that their body is in."""
        freeway, others = self._freeway, self._others
        states = scene.states[others]
        aside = turned_extents(scene.length[others] / 2, scene.width[others] / 2, states[:, 3])[1]
        freeway.lon[0, others] = states[:, 0]
        freeway.speed[0, others] = states[:, 2] * np.cos(states[:, 3])
        freeway.lane[0, others] = self._road.lane_at(states[:, 0], states[:, 1] - aside)
        freeway.target[0, others] = self._road.lane_at(states[:, 0], states[:, 1] + aside)
        freeway.progress[0, others] = 0.0
        freeway.wait[0, others] = np.inf
