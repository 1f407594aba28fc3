"""Replayed traffic: recorded vehicles drive as they did, with the ego in the place of one of them or between two.

They are where, and as fast as, they were seen at each moment (`coverdrive.recordings.tracks.filtering`): nothing that
the ego is shown knows their future. Recorded vehicles do not react to the ego: they may run into it, which is counted
as their fault unless it had just cut in, and none makes room for it. A vehicle is there while it was recorded, but for
the time in which it would appear on the ego. Use scenes that neither trained nor calibrated the predictor
(`coverdrive.prediction.data.held_out`). F moments, A vehicles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import jax
import numpy as np
import polars as pl
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import DataError, StartError
from coverdrive.recordings.recording import MEASURES, SEEN, Recording
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import Settings
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.model import Start, TrafficStep
from coverdrive.simulation.traffic.motion import with_states

REPLAYS = "replay", "reactive-replay"
"""kinds of traffic that replay recordings"""

_ATTEMPTS = 1000

_ROUNDING = 1e-6
"""of a number of moments"""


class ReplaySettings(Settings):
    """Recorded traffic that does not react."""

    kind: Literal["replay"] = "replay"
    """name of this traffic"""
    place: Literal["replace", "between", "either"] = "either"
    """where the ego starts: as a recorded vehicle, which is taken out, in the middle between two successive ones
    of a lane, or as the one or the other by chance"""
    shortest: float = Field(default=5.0, ge=0.1, le=3600)
    """[s] for which the recording, and the vehicle that is replaced, must go on: longer than a prediction"""
    gap: float = Field(default=4.0, ge=0, le=1000)
    """[m] least bumper-to-bumper distance of the ego at the start"""


@dataclass(frozen=True)
class Scenario:
    """Recorded vehicles of one road and one group of scenes on one clock."""

    states: Float[np.ndarray, "F A 4"]
    """(lon, lat, speed, heading); zero where a vehicle is not there"""
    sizes: Float[np.ndarray, "A 2"]
    """[m] length and width"""
    valid: Bool[np.ndarray, "F A"]
    """whether a vehicle is there"""
    dt: float
    """[s] between two moments"""
    road: Road


def hash_of_scenarios(scenarios: Sequence[Scenario]) -> str:
    """A short hash of who drove where, and on which roads."""
    told = list[np.ndarray]()
    for each in scenarios:
        parts = each.states, each.sizes, each.valid, each.dt, each.road.side, *jax.tree.leaves(each.road)
        told.extend(map(np.asarray, parts))
    return fingerprint(*told)


def cut_scenarios(recordings: Sequence[Recording]) -> tuple[Scenario, ...]:
    """One for each group of scenes of each recording."""
    return tuple(
        _scenario(recording, table)
        for recording in recordings
        for table in recording.rates.partition_by("group", maintain_order=True)
    )


def _scenario(recording: Recording, table: pl.DataFrame) -> Scenario:
    moment = np.rint(table["time"].to_numpy() / recording.dt).astype(np.int64)
    moment -= moment.min()
    _, first, slot = np.unique(table["vehicle"].to_numpy(), return_index=True, return_inverse=True)
    shape = (int(moment.max()) + 1, len(first))
    states, valid = np.zeros((*shape, 4)), np.zeros(shape, dtype=bool)
    states[moment, slot] = table.select(SEEN.names()).to_numpy()
    valid[moment, slot] = True
    return Scenario(states, table.select(MEASURES[4:]).to_numpy()[first], valid, recording.dt, recording.road)


class ReplayTraffic:
    """Uncontrolled vehicles that do what they did when they were recorded."""

    def __init__(self, scenarios: Sequence[Scenario], settings: ReplaySettings):
        """Replay some of the scenarios; a DataError if none lasts long enough."""
        self._settings, least = settings, settings.shortest
        self._scenarios = [each for each in scenarios if (len(each.states) - 1) * each.dt >= least - 1e-6]
        if not self._scenarios:
            raise DataError(
                f"none of the {len(scenarios)} recorded scenes lasts {least} s; give longer recordings, or a smaller "
                "traffic.shortest"
            )

    def start(self, settings: InitialSettings, vehicles: int, rng: np.random.Generator) -> Start:
        """Draw a scene, long ones more often, a moment and a place for an ego of the settings' size.

        Every recorded vehicle is there, whatever ``vehicles`` says. A StartError if the ego fits nowhere.
        """
        room = [len(scenario.states) - round(self._settings.shortest / scenario.dt) for scenario in self._scenarios]
        for _ in range(_ATTEMPTS):
            chosen = int(rng.choice(len(room), p=np.array(room) / sum(room)))
            scenario, first = self._scenarios[chosen], int(rng.integers(room[chosen]))
            found = self._place(scenario, first, settings, rng)
            if found is not None:
                return self._begin(scenario, first, *found, settings)
        raise StartError(
            f"the ego of {settings.length} m fits nowhere into the recorded scenes with gaps of "
            f"{self._settings.gap} m in {_ATTEMPTS} attempts; give other recordings, or a smaller traffic.gap"
        )

    def _place(
        self, scenario: Scenario, first: int, settings: InitialSettings, rng: np.random.Generator
    ) -> tuple[Float[np.ndarray, " 4"], Bool[np.ndarray, " A"]] | None:
        """The ego's state and who is left, or None if this draw leaves no room for it."""
        present = np.flatnonzero(scenario.valid[first])
        if len(present) == 0:
            return None
        last = first + round(self._settings.shortest / scenario.dt)
        chosen = rng.choice(present)
        states, kept = scenario.states[first], np.ones(scenario.valid.shape[1], dtype=bool)
        place = self._settings.place
        if place == "replace" or (place == "either" and rng.random() < 0.5):
            if not scenario.valid[first : last + 1, chosen].all():
                return None
            own, kept[chosen] = states[chosen], False
        else:
            lane = scenario.road.lane_at(states[:, 0], states[:, 1])
            ahead = scenario.valid[first] & (lane == lane[chosen]) & (states[:, 0] > states[chosen, 0])
            if not ahead.any():
                return None
            leader = np.flatnonzero(ahead)[states[ahead, 0].argmin()]
            own = (states[chosen] + states[leader]) / 2
            ends = states[[chosen, leader], 0] + scenario.sizes[[chosen, leader], 0] * [0.5, -0.5]
            edges = scenario.road.edges_at(ends.mean())
            own[0], own[1], own[3] = ends.mean(), edges[lane[chosen] : lane[chosen] + 2].mean(), 0.0
        near = scenario.valid[first] & kept
        in_the_way = self._in_the_way(own, np.array([settings.length, settings.width]), states, scenario.sizes)
        return None if (near & in_the_way).any() else (own, kept)

    def _in_the_way(
        self, own: Float[np.ndarray, " 4"], own_size: np.ndarray, states: np.ndarray, sizes: np.ndarray
    ) -> Bool[np.ndarray, " A"]:
        """Which vehicles are nearer to the ego, in its way, than a start allows."""
        apart = np.abs(states[:, :2] - own[:2]) - (sizes + own_size) / 2
        return (apart[:, 0] < self._settings.gap) & (apart[:, 1] < 0)

    def _begin(
        self, scenario: Scenario, first: int, own: Float[np.ndarray, " 4"], kept: Bool[np.ndarray, " A"],
        settings: InitialSettings,
    ) -> Start:  # fmt: skip
        """The scene at the start; what follows is kept for `step`."""
        kept = kept & scenario.valid[first:].any(0)
        self._states, self._valid, self._dt = scenario.states[first:, kept], scenario.valid[first:, kept], scenario.dt
        lon, lat, speed, heading = np.concatenate([own[None], self._states[0]]).T
        length, width = np.concatenate([[[settings.length, settings.width]], scenario.sizes[kept]]).T
        valid = np.concatenate([[True], self._valid[0]])
        scene = Scene(lon, lat, speed, heading, length, width, valid)
        return Start(scene, scenario.road, (len(self._states) - 1) * scenario.dt)

    def reset(self, scene: Scene, road: Road, rng: np.random.Generator) -> None:
        """Begin the scene that `start` has drawn."""
        self._time = 0.0

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Show the recorded vehicles ``dt`` [s] later, interpolated between recorded moments."""
        self._time += dt
        moment = min(self._time / self._dt, len(self._states) - 1)
        before, after = int(moment + _ROUNDING), int(np.ceil(moment - _ROUNDING))
        share = moment - before
        there = self._valid[before] & self._valid[after]
        states, sizes = scene.states, 2 * scene.half_sizes
        recorded = (1 - share) * self._states[before] + share * self._states[after]
        own = states[EGO] + np.array([dt * states[EGO, 2], 0.0, 0.0, 0.0])
        appearing = there & ~np.asarray(scene.valid)[EGO + 1 :]
        there &= ~(appearing & self._in_the_way(own, sizes[EGO], recorded, sizes[EGO + 1 :]))
        states[EGO + 1 :][there] = recorded[there]
        moved = replace(with_states(scene, states), valid=np.concatenate([[True], there]))
        return TrafficStep.without_bases(moved)
