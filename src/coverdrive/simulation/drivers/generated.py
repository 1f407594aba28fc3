"""Generated traffic on a freeway, for trying everything out without recorded data.

Seeded scenes of IDM and MOBIL drivers (`coverdrive.simulation.drivers.idm_mobil`): cars and trucks, free flow to
stop-and-go.
"""

import re
from collections import Counter
from typing import Annotated

import numpy as np
import polars as pl
from pydantic import Field, model_validator

from coverdrive.arguments import of_kind, whole
from coverdrive.progress import done
from coverdrive.recordings.checks import FASTEST, LANE_WIDTHS, TIME_STEPS
from coverdrive.recordings.recording import MEASURES, SCHEMA, Recording
from coverdrive.recordings.tracks.reading import regular_table
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.settings import InOrder
from coverdrive.simulation.drivers.freeway import DECISION, Freeway
from coverdrive.simulation.drivers.idm_mobil import TRUCK_LENGTH, TRUCK_PACE, DriverSettings, draw_drivers
from coverdrive.simulation.roads.course import Course
from coverdrive.simulation.roads.settings import UNLIMITED, RoadSettings

BATCH = 24
"""Scenes that are driven at once"""

WARM_UP = 10.0
"""[s] that each scene is driven before it is recorded"""

MOOD_PAUSE = 12.0
"""[s] between two times that somebody slows down without a reason, on average"""

FRONT_PACE = (0.85, 1.1)
"""Desired speeds of those in front, as shares of the speed at which the vehicles of their scene start"""

_FARTHEST = 1e4
"""[m] a road that is longer than anybody drives"""

_MOST_ROWS = 2e7
"""of all scenes: about 2 GB"""

_Count = Annotated[int, Field(ge=1, le=1000)]
_Speed = Annotated[float, Field(gt=0, le=120)]


class GeneratedSettings(RoadSettings):
    """How much traffic is generated, of which kind, and on which road."""

    scenes: int = Field(default=48, ge=1, le=10_000)
    """number of independent scenes; 48 of them hold over 200,000 windows of 3 s at a stride of 0.1 s"""
    duration: float = Field(default=20.0, ge=1, le=3600)
    """[s] of each scene"""
    dt: float = Field(default=0.1, ge=TIME_STEPS[0], le=0.2)
    """[s] as in NGSIM"""
    lane_width: float = Field(default=3.6, ge=3, le=LANE_WIDTHS[1])
    """[m] the US freeway standard (AASHTO)"""
    vehicles: Annotated[tuple[_Count, _Count], InOrder] = (20, 30)
    """fewest and most vehicles of a scene"""
    speed: Annotated[tuple[_Speed, _Speed], InOrder] = (14.0, 32.0)
    """[m/s] lowest and highest speed at which the vehicles of a scene start"""
    truck_share: float = Field(default=0.1, ge=0, le=1)
    """share of trucks; about 3 % in NGSIM US-101"""
    drivers: DriverSettings = DriverSettings(time_gap=1.6, acceleration=3.0, deceleration=1.5, safe_deceleration=1.5)
    """how people drive: livelier and with more foresight than in the literature, so that speeding up is as common as
    slowing down, as it is in recorded US-101 traffic"""
    moody_share: float = Field(default=0.15, ge=0, le=1)
    """share of drivers, besides those in front, who slow down now and then without a reason"""
    wander: float = Field(default=0.15, ge=0, le=0.3)
    """[m] largest amplitude of the lateral motion within the lane"""
    noise: float = Field(default=0.0, ge=0, le=10)
    """[m] standard deviation of the measured positions; if positive, they are smoothed like recorded ones"""

    @model_validator(mode="after")
    def _is_no_faster_than_recorded(self) -> "GeneratedSettings":
        limit, wanted = self.speed_limit, self.drivers.desired_speed * (1 + 2 * self.drivers.spread)
        if FASTEST < limit < UNLIMITED:
            raise ValueError(f"a limit of {limit:g} m/s is more than {FASTEST:g} m/s; {UNLIMITED:g} is none")
        fastest = min(limit, max(wanted, FRONT_PACE[1] * self.speed[1]))
        if fastest > FASTEST:
            found = f"drivers want to drive up to {fastest:.3g} m/s, which is more than {FASTEST:g} m/s"
            raise ValueError(f"{found}; lower speed, drivers.desired_speed or speed_limit")
        return self

    @model_validator(mode="after")
    def _fits_into_memory(self) -> "GeneratedSettings":
        rows = self.scenes * self.vehicles[1] * self.duration / self.dt
        if rows > _MOST_ROWS:
            limit = f"{rows:.3g} rows of traffic are more than {_MOST_ROWS:.0e}"
            raise ValueError(f"{limit}; generate fewer or shorter scenes")
        return self


def generate(settings: GeneratedSettings | None = None, seed: int = 0) -> tuple[Recording, ...]:
    """Generate scenes; each is a recording and a group of its own, and no vehicle number occurs twice.

    The same settings and seed give the same traffic.

    Args:
        settings: of scenes, road, drivers and time step; the defaults if left out.
        seed: of all that is random, at least 0.

    Raises:
        SettingError: the settings are of another kind, or the seed is no whole number of at least 0.
    """
    chosen = GeneratedSettings() if settings is None else settings
    of_kind("settings", chosen, GeneratedSettings, "GeneratedSettings")
    seed = whole("seed", seed)
    counts = [min(BATCH, chosen.scenes - first) for first in range(0, chosen.scenes, BATCH)]
    streams = np.random.default_rng(seed).spawn(len(counts))
    recordings: list[Recording] = []
    for scenes, random in zip(counts, streams, strict=True):
        recordings += _batch(chosen, random, scenes, len(recordings))
        done(len(recordings), chosen.scenes)
    return tuple(recordings)


def _batch(settings: GeneratedSettings, random: np.random.Generator, scenes: int, first: int) -> list[Recording]:
    """Drive some scenes at once and cut them into recordings, numbered from ``first``."""
    traffic = _start(settings, random, scenes)
    dt = settings.dt
    warm_up, steps = round(WARM_UP / dt), round(settings.duration / dt) + 1
    decide = max(1, round(DECISION / dt))
    track = np.empty((scenes, traffic.lon.shape[1], steps, len(MEASURES)))
    for step in range(warm_up + steps):
        if step >= warm_up:
            sizes = np.stack([traffic.length, traffic.width], axis=-1)
            track[:, :, step - warm_up] = np.concatenate([traffic.states(settings.lane_width), sizes], axis=-1)
        traffic.change_desires(random, dt, MOOD_PAUSE)
        if step % decide == 0:
            traffic.change_lanes()
        traffic.advance(dt)
    most = settings.vehicles[1]
    return [
        _recording(settings, random, track[scene, traffic.valid[scene]], first + scene, (first + scene) * most)
        for scene in range(scenes)
    ]


def _start(settings: GeneratedSettings, random: np.random.Generator, scenes: int) -> Freeway:
    """Vehicles in lanes at gaps that suit their speed, the frontmost of every lane without a leader."""
    fewest, most = settings.vehicles
    shape = (scenes, most)
    valid = np.arange(most) < random.integers(fewest, most, scenes, endpoint=True)[:, None]
    truck = random.random(shape) < settings.truck_share
    length = np.where(truck, random.uniform(TRUCK_LENGTH, 16, shape), random.normal(4.7, 0.35, shape).clip(3.7, 5.7))
    width = np.where(truck, 2.5, random.normal(1.85, 0.08, shape).clip(1.6, 2.1))
    road = settings.road_of(_FARTHEST)
    ramp = road.lanes - settings.lanes
    dealt = np.arange(most) % (2 * settings.lanes + ramp)  # half as many on a ramp as in a lane that goes on
    lane = random.permuted(np.broadcast_to((dealt + ramp * (dealt >= road.lanes)) % road.lanes, shape), axis=1)
    drivers = draw_drivers(settings.drivers, random, shape)
    drivers.desired_speed[truck] *= TRUCK_PACE

    pace = random.uniform(*settings.speed, (scenes, 1))
    speed = np.minimum(pace, 0.95 * drivers.desired_speed) * random.uniform(0.97, 1.0, shape)
    speed = np.minimum(speed, settings.speed_limit)
    gap = (drivers.minimum_gap + speed * drivers.time_gap) * random.uniform(1.1, 2.2, shape)
    lon = np.zeros(shape)
    front = np.zeros(shape, dtype=bool)
    for number in range(road.lanes):
        inside = (lane == number) & valid
        room = np.where(inside, gap + length, 0.0)
        lon = np.where(inside, length / 2 - np.cumsum(room, axis=1), lon)
        front |= inside & (np.cumsum(inside, axis=1) == 1)
    rear = np.where(valid, lon, 0.0).min(axis=1, keepdims=True)
    on_ramp = valid & (lane < ramp)
    lon = lon - np.where(on_ramp, np.where(on_ramp, lon, np.inf).min(axis=1, keepdims=True) - rear, 0.0)
    drivers.desired_speed[front] = (pace * random.uniform(*FRONT_PACE, shape))[front]
    limits = ((0, settings.wander), (150, 400), (0, 2 * np.pi))
    wander = np.stack([random.uniform(*between, shape) for between in limits], axis=-1)
    lon, course = lon - rear + 20.0, Course(road)
    valid = valid & (course.ends[1][lane] - lon > speed**2 / (2 * drivers.deceleration) + length)  # can stop in time
    return Freeway(
        course=course,
        drivers=drivers,
        moody=front | (random.random(shape) < settings.moody_share),
        length=length,
        width=width,
        valid=valid,
        lon=lon,
        speed=speed,
        lane=lane,
        change_duration=random.uniform(4, 6, shape),
        wander=wander,
    )


def _recording(
    settings: GeneratedSettings, random: np.random.Generator, track: np.ndarray, scene: int, first_vehicle: int
) -> Recording:
    """The recording of one scene from the measures of all its vehicles at all times."""
    vehicles, steps, _ = track.shape
    values = dict(zip(MEASURES, track.reshape(-1, len(MEASURES)).T.copy(), strict=True))
    vehicle = np.repeat(first_vehicle + np.arange(vehicles), steps)
    group = np.full_like(vehicle, scene)
    moment = np.tile(np.arange(steps), vehicles)
    road = settings.road_of(float(np.ceil(values["lon"].max() + 20)))
    if road.line is not None:
        speed, heading = values["speed"], values["heading"]
        along = speed * np.cos(heading) * road.stretch(values["lon"], values["lat"])
        across = speed * np.sin(heading)
        values |= {"speed": np.hypot(along, across), "heading": np.arctan2(across, along)}
    if settings.noise:
        for name in ("lon", "lat"):
            values[name] += settings.noise * random.standard_normal(len(moment))
        positions = {name: values[name] for name in MEASURES if name != "heading"}
        raw = RawTracks(vehicle=vehicle, moment=moment, group=group, **positions)
        table = regular_table(raw, settings.dt, SmoothingSettings(), Counter(), road)
    else:
        head = {"vehicle": vehicle, "group": group, "time": moment * settings.dt}
        table = pl.DataFrame(head | values, schema=SCHEMA)
    return Recording(f"generated {scene + 1}", table, settings.dt, road, {})


def is_generated(name: str) -> bool:
    """Whether a recording of such a name is one of these."""
    return re.fullmatch(r"generated \d+", name) is not None
