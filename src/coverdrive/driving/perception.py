"""What is told of vehicles by their names, in map coordinates, as scenes whose slots stay theirs.

A vehicle is told as (x, y, speed, heading), which is taken as it is, or as a measured position (x, y) alone: then a
Kalman filter says how it moves (`coverdrive.recordings.tracks.filtering`), as it does of recorded vehicles.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.errors import DataError
from coverdrive.recordings.tracks.filtering import Sight
from coverdrive.recordings.tracks.repair import LONGEST_GAP
from coverdrive.recordings.tracks.smoothing import SmoothingSettings, motion
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.roads.initial import EGO

Numbers = Sequence[float] | Float[np.ndarray, " n"]
Told = tuple[Numbers, Numbers]
"""of a vehicle: (x [m], y [m], speed [m/s], heading [rad]) or (x [m], y [m]) of its centre in map coordinates, and
(length [m], width [m])"""

_STATE = "x [m], y [m], speed [m/s] and heading [rad] of its centre"
_FASTEST, _LARGEST = 150.0, 100.0
"""[m/s], [m] beyond which numbers are not those of a vehicle"""
_NOWHERE = np.full(2, np.nan)
_KEPT = 2 * LONGEST_GAP
"""[s] for which measured positions of a vehicle are kept"""
_SAME = 0.01
"""[m] nobody is nearer to the ego's centre but itself"""


@dataclass
class _Vehicle:
    """Who has a slot."""

    slot: int
    last: int
    """moment at which it was last told of"""
    sight: Sight = field(default_factory=Sight)
    """what is known from measured positions"""
    measured: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    """x [m] and y [m] of the last of these, not numbers where there were none"""


class Perception:
    """Gives every vehicle a slot for as long as it is there, and some time longer."""

    def __init__(self, size: tuple[float, float], period: float, forget: float, smoothing: SmoothingSettings):
        """See vehicles from a car.

        Args:
            size: [m] length and width of the car.
            period: [s] between two moments.
            forget: [s] after which the slot of a vehicle that vanished may become another's.
            smoothing: noises of measured positions.
        """
        self._size, self._period, self._smoothing = size, period, smoothing
        self._forget = forget / period
        self.reset()

    def reset(self) -> None:
        """Forget all vehicles."""
        self._vehicles: dict[Hashable, _Vehicle] = {}
        self._moment, self._slots = 0, EGO + 1
        self._road: Road | None = None

    def scene(self, own: Any, others: Any, road: Road) -> Scene:
        """The scene of the next moment in the road frame, the ego in slot 0; of what `Driver.step` is told.

        Raises:
            DataError: what is told of a vehicle cannot be true; the message names it.
        """
        if not isinstance(others, Mapping):
            raise DataError(f"the others are {others!r}; expected a dict of their states and sizes by their names")
        states = [_numbers("the ego", own, (4,), _STATE)]
        sizes = [np.array(self._size)]
        for name, told in others.items():
            state, size = _told(name, told)
            if np.abs(state[:2] - states[0][:2]).max() < _SAME:
                problem = f"vehicle {name!r} is at ({state[0]:g}, {state[1]:g}) m, where the ego is"
                raise DataError(f"{problem}; leave the ego out of the others")
            states.append(state)
            sizes.append(size)
        if self._road is not None and not road.same(self._road):
            self._see_again(road)
        self._road = road
        measured = np.array([len(state) == 2 for state in states])
        whole = np.array([np.append(state, [0.0, 0.0])[:4] for state in states])
        places = whole[:, :2].tolist()
        whole[:, 0], whole[:, 1] = road.to_road(whole[:, 0], whole[:, 1])
        whole[:, 3] = road.heading_to_road(whole[:, 0], whole[:, 3])
        turned = np.abs(whole[:, 3]) > np.pi
        whole[turned, 3] = np.remainder(whole[turned, 3] + np.pi, 2 * np.pi) - np.pi
        seen = self._look(list(others), whole, places, measured, road)
        speed, heading = road.rates(whole[:, 0], whole[:, 1], np.abs(whole[:, 2]), whole[:, 3])
        whole[:, 2], whole[:, 3] = np.copysign(speed, whole[:, 2]), heading
        self._moment += 1
        slots = np.array([EGO, *(self._vehicles[name].slot for name in others)])
        values, valid = np.zeros((6, self._slots)), np.zeros(self._slots, dtype=bool)
        values[:, slots] = np.concatenate([whole, sizes], axis=1).T
        valid[slots] = seen
        lon, lat, speed, heading, length, width = values
        return Scene(lon, lat, speed, heading, length, width, valid)

    def _look(
        self, names: list[Hashable], states: Float[np.ndarray, "n 4"], places: list[list[float]], measured: np.ndarray,
        road: Road,
    ) -> np.ndarray:  # fmt: skip
        """Put what is known of measured vehicles into the states of all; tell whose states are known."""
        for name, vehicle in list(self._vehicles.items()):
            if self._moment - vehicle.last > self._forget:
                del self._vehicles[name]
        known, rates = np.ones(len(states), dtype=bool), np.zeros((len(states), 2))
        for i, name in enumerate(names, start=1):
            vehicle = self._vehicles.get(name) or self._new(name)
            missing = self._moment - vehicle.last - 1
            if not measured[i] or missing * self._period > LONGEST_GAP:
                vehicle.sight, vehicle.measured = Sight(), []
            elif vehicle.sight.begun:
                for _ in range(missing):
                    self._measure(vehicle, _NOWHERE, _NOWHERE)
            vehicle.last = self._moment
            if measured[i]:
                found = self._measure(vehicle, states[i, :2], places[i])
                known[i] = found is not None
                if found is not None:
                    states[i, :2], rates[i] = found[:2], found[2:]
        lon, lat = states[measured, :2].T
        along, across = rates[measured].T
        states[measured, 2:] = np.transpose(motion(along * road.stretch(lon, lat), across))
        return known

    def _measure(self, vehicle: _Vehicle, position: Numbers, place: Numbers) -> Float[np.ndarray, " 4"] | None:
        """`Sight.measure` of a position on the road, whose place on the map is kept for another road."""
        vehicle.measured = [*vehicle.measured[-math.ceil(_KEPT / self._period) :], (place[0], place[1])]
        noises = self._smoothing.position_noise, self._smoothing.acceleration_noise
        return vehicle.sight.measure(np.asarray(position, dtype=float), self._period, noises)

    def _see_again(self, road: Road) -> None:
        """Measure all vehicles anew, on another road."""
        for vehicle in self._vehicles.values():
            vehicle.sight, places = Sight(), vehicle.measured
            for place in places:
                self._measure(vehicle, road.to_road(*place), place)

    def _new(self, name: Hashable) -> _Vehicle:
        """Give a vehicle the first slot that is free."""
        taken = {each.slot for each in self._vehicles.values()}
        slot = next(slot for slot in count(EGO + 1) if slot not in taken)
        self._slots = max(self._slots, slot + 1)
        self._vehicles[name] = _Vehicle(slot, self._moment)
        return self._vehicles[name]


def _told(name: Hashable, told: Any) -> tuple[np.ndarray, np.ndarray]:
    """The state and the size of a vehicle."""
    who = f"vehicle {name!r}"
    try:
        state, size = told
    except (TypeError, ValueError):
        raise DataError(f"{who}: got {told!r}; expected its state and its size, ({_STATE}), (length, width)") from None
    state = _numbers(who, state, (2, 4), f"{_STATE}, or its measured x and y alone")
    size = _numbers(who, size, (2,), "length and width [m]")
    if not (size.min() > 0 and size.max() <= _LARGEST):
        problem = f"{who} is {size[0]:g} m long and {size[1]:g} m wide; expected metres above 0, at most {_LARGEST:g} m"
        raise DataError(f"{problem}: check the unit, or cut it into several")
    return state, size


def _numbers(who: str, values: Any, counts: tuple[int, ...], expected: str) -> Float[np.ndarray, " n"]:
    """Finite numbers, or a DataError that says whose they were to be."""
    try:
        result = np.asarray(values, dtype=float) if np.isrealobj(values) else np.empty(0)
    except (TypeError, ValueError, OverflowError):
        result = np.empty(0)
    if result.ndim != 1 or len(result) not in counts or not np.isfinite(result).all():
        hint = "leave a vehicle out while it is not known" if who != "the ego" else "the ego has to be known"
        raise DataError(f"{who}: got {values!r}; expected finite numbers: {expected}; {hint}")
    if len(result) == 4 and abs(result[2]) > _FASTEST:
        raise DataError(f"{who} drives at {result[2]:g} m/s; expected at most {_FASTEST:g} m/s, check the unit")
    return result
