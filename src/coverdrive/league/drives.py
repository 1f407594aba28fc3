"""Drives of one entrant in one world, as `coverdrive.simulation.workers` has them driven; equal seeds begin alike."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coverdrive.bridges.world import World, drive
from coverdrive.driving.driver import Driver, adapted
from coverdrive.league.entrants import Known, Place, Seat, entrant, identity
from coverdrive.league.others import OTHERS
from coverdrive.league.problems import Problems
from coverdrive.plan import Planner
from coverdrive.planning.planner import MpcPlanner
from coverdrive.progress import heard_by
from coverdrive.simulation.predictor import Learning, as_given
from coverdrive.simulation.setup import Setup, described, made
from coverdrive.simulation.trial import Row, measure
from coverdrive.simulation.workers import Drives


@dataclass(frozen=True, eq=False)
class DrivesOfOthers:
    """Drives in a world of others; implements `coverdrive.simulation.workers.Drives`."""

    world: str
    """its name"""
    seat: Seat
    """what drives there, for the car of that world"""
    seed: int
    """of all drives"""
    duration: float | None
    """[s] of a drive at the most; the world's own if left out"""

    def description(self) -> dict[str, Any]:
        """Everything that a drive depends on."""
        belief, planner = self.seat
        return {
            "world": self.world,
            "seed": self.seed,
            "duration": self.duration,
            "predictor": identity(belief),
            "planner": described(planner),
        }

    def participants(self) -> tuple[World, Driver | None]:
        """The world, and who drives in it, or None for its own driver."""
        there = OTHERS[self.world]
        return there.make(there.of), self._driver()

    def _driver(self) -> Driver | None:
        there, (belief, planner) = OTHERS[self.world], self.seat
        if belief is None or planner is None:
            return None
        planner = made(planner, Planner)
        ours = isinstance(planner, MpcPlanner)  # which knows its car
        length, width = (None if ours else there.ego[name] for name in ("length", "width"))
        return Driver(as_given(belief), planner, length=length, width=width)

    def row(self, trial: int, participants: tuple[World, Driver | None]) -> Row:
        """Drive, and keep the measures."""
        seed = int(np.random.SeedSequence(self.seed, spawn_key=(trial,)).generate_state(1)[0] >> 1)
        world, driver = participants
        if isinstance(self.seat.belief, Learning):
            driver = self._driver()
        with heard_by(None):
            return measure(drive(world, driver, seed, self.duration), self.seed, trial)


def drives_of(
    world: str,
    name: str,
    known: Known,
    setups: Mapping[str, Setup],
    seed: int,
    duration: float | None,
    problems: Mapping[str, Problems] | None = None,
) -> Drives | str:
    """The drives of an entrant in a world, or why there are none.

    Args:
        world: in our traffic, one of the ``setups``; of CommonRoad, one of the ``problems``; else one of
            `coverdrive.league.others.OTHERS`.
        name: of the entrant.
        known: what it may be made of.
        setups: studies of the default in our traffics.
        seed: of drives in worlds of others.
        duration: [s] of these at the most.
        problems: worlds of planning problems, which say how long they take.
    """
    if problems and world in problems:
        return problems[world].drives(name, known, seed)
    usual = setups.get(world)
    if usual is None:
        there = OTHERS[world]
        settings = adapted(known.planner, **there.ego)
        leaders = settings.leaders.model_copy(update={"deceleration": there.braking})
        settings = settings.model_copy(update={"leaders": leaders})
        seat = entrant(name)(known, Place(settings, own_driver=True))
        return seat if isinstance(seat, str) else DrivesOfOthers(world, seat, seed, duration)
    assert isinstance(usual.planner, MpcPlanner)
    seat = entrant(name)(known, Place(usual.planner.settings, usual.foretold))
    if isinstance(seat, str) or seat.belief is None or seat.planner is None:
        return seat if isinstance(seat, str) else "it drives in its own world"
    return replace(usual, predictor=seat.belief, planner=seat.planner, sampled=known.predictor)
