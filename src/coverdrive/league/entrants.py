"""Who takes part in the league, by name: what the ego believes of the others, and how it plans.

Anybody else enters as ``module:factory``: a function of the `coverdrive.planning.planner.PlannerSettings` of the world
(size of the car, wanted speed), or of nothing, that makes a `coverdrive.plan.Planner`, an
`coverdrive.league.agents.Agent`, or a `coverdrive.simulation.predictor.Belief`, with which our planner drives.
"""

import inspect
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coverdrive.certificates.certificate import Certificate, fingerprint
from coverdrive.errors import SettingError, blaming
from coverdrive.extras import EXTRAS
from coverdrive.league.agents import Agent, AgentPlanner, Idm, IdmMobil, KeepVelocity, Witness
from coverdrive.league.beliefs import ConstantVelocity, KnownFuture
from coverdrive.league.fiss import FISS, absent
from coverdrive.percentages import at_most, percent
from coverdrive.plan import Planner
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.simulation.predictor import Belief, Predictor
from coverdrive.simulation.studies.setup import AnyPlanner, Setup
from coverdrive.simulation.traffic.replay import Scenario


@dataclass(frozen=True, eq=False)
class Known:
    """What entrants may be made of."""

    predictor: Predictor
    """of the default"""
    paper: Belief | str
    """the predictor of the paper's preset, or why there is none"""
    box: Belief | str
    """constant velocity in one conformal box, or why there is none"""
    planner: PlannerSettings
    """of ours, but for the car and the wanted speed, where a world has others"""


class Place(NamedTuple):
    """What is said of a world to those who drive in it."""

    settings: PlannerSettings
    """with the size of the car and the wanted speed"""
    future: Sequence[Scenario] = ()
    """what recorded vehicles will do"""
    own_driver: bool = False
    """whether it has a driver of its own"""
    problems: bool = False
    """whether planning problems are solved there"""


class Seat(NamedTuple):
    """What an entrant drives with; two Nones are the world's own driver, or FISS."""

    belief: Belief | None
    planner: AnyPlanner | None


def seated(setup: Setup, name: str, known: Known) -> Setup | str:
    """The drives of an entrant in place of the default in our traffic, or why it does not take part."""
    assert isinstance(setup.planner, MpcPlanner)
    seat = entrant(name)(known, Place(setup.planner.settings, setup.foretold))
    if isinstance(seat, str) or seat.belief is None or seat.planner is None:
        return seat if isinstance(seat, str) else "it drives in its own world"
    return replace(setup, predictor=seat.belief, planner=seat.planner, sampled=known.predictor)


def claim_of(belief: Belief | None) -> str:
    """What is proved of the sets of a belief, and their scale λ, in a few words; empty where no certificate says it."""
    claim = getattr(belief, "certificate", None) or getattr(belief, "claim", None)
    if not isinstance(claim, Certificate):
        return ""
    surely = "on average" if claim.confidence is None else percent(claim.confidence, 10)
    bound = f"{claim.unit}{' of each base' * (claim.groups > 1)} ≤ {at_most(claim.epsilon)} ({surely})"
    return f"{bound if claim.epsilon < 1 else 'no bound'}, λ {claim.scale:.3g}"


def _paper(known: Known, place: Place) -> Seat | str:
    if isinstance(known.paper, str):
        return known.paper
    if find_spec("casadi") is None:
        return f"its program needs CasADi; install it with `{EXTRAS['casadi'].command}`"
    return Seat(known.paper, partial(_paper_planner, place.settings))


def _paper_planner(settings: PlannerSettings) -> Planner:
    from coverdrive.league.paper_way import PaperPlanner  # needs CasADi

    return PaperPlanner(settings.problem, settings.lane_change)


def _with(belief: Belief | str, place: Place) -> Seat | str:
    """Our planner with a belief, if there is one."""
    return belief if isinstance(belief, str) else Seat(belief, MpcPlanner(place.settings))


def _known_future(known: Known, place: Place) -> Seat | str:
    return _with(KnownFuture(place.future) if place.future else "only replay tells it what will be", place)


def _acting(make: Callable[[], Agent], place: Place) -> Seat:
    """An agent in the car of a place, and what shows it the scene."""
    witness = Witness()
    return Seat(witness, partial(_agent_planner, make, witness, place.settings.problem.vehicle))


def _agent_planner(make: Callable[[], Agent], witness: Witness, vehicle: VehicleSettings) -> Planner:
    return AgentPlanner(make(), witness, vehicle)


def _fiss(known: Known, place: Place) -> Seat | str:
    return (absent() or Seat(None, None)) if place.problems else "it solves planning problems of CommonRoad alone"


def _own(known: Known, place: Place) -> Seat | str:
    return Seat(None, None) if place.own_driver else "there everybody else is the world's own driver"


ENTRANTS: dict[str, Callable[[Known, Place], Seat | str]] = {
    "default": lambda known, place: _with(known.predictor, place),  # certified sets, and our planner
    "paper": _paper,  # the paper's sets, and its program solved by IPOPT
    "paper-sets": lambda known, place: _with(known.paper, place),  # the paper's sets, and our planner
    "constant-velocity-box": lambda known, place: _with(known.box, place),  # one box, as certain as the default's sets
    "constant-velocity": lambda known, place: _with(ConstantVelocity(), place),  # bodies that keep their velocity
    "known-future": _known_future,  # what recorded vehicles will do, and our planner
    "idm-mobil": lambda known, place: _acting(partial(IdmMobil, place.settings), place),
    "idm": lambda known, place: _acting(Idm, place),  # in the lane of the start
    "keep-velocity": lambda known, place: _acting(KeepVelocity, place),  # in the lane of the start
    "fiss-future": _fiss,  # FISS+, told what recorded vehicles will do
    "fiss-constant-velocity": _fiss,
    "own": _own,  # the world's own driver: IDM and MOBIL in highway-env, Krauss and LC2013 in SUMO
}
"""what makes an entrant for a place, or says why it does not take part"""

USUAL = [name for name in ENTRANTS if name not in ("paper", "idm", "keep-velocity", *FISS)]
"""who drives if nobody is named; the paper's program takes seconds for every step"""

ON_PROBLEMS = ["default", "constant-velocity-box", "constant-velocity", "idm", "keep-velocity", *FISS]
"""the same for planning problems of CommonRoad"""


def entrant(name: str) -> Callable[[Known, Place], Seat | str]:
    """What seats the entrant of a name or a ``module:factory``; a SettingError if there is none."""
    if name in ENTRANTS:
        return ENTRANTS[name]
    if ":" not in name:
        raise SettingError(
            f"no planner is called {name!r}; choose {', '.join(ENTRANTS)}, or name your own as module:factory"
        )
    factory_of(name)
    return partial(_entered, name)


def factory_of(name: str) -> Callable[..., Any]:
    """What ``module:factory`` names, the module in the current folder or installed; a SettingError if there is none."""
    module, _, factory = name.partition(":")
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)
    try:
        with blaming("module", module):
            found = getattr(import_module(module), factory)
    except (ImportError, ValueError, AttributeError) as error:
        raise SettingError(f"{name}: {error}; expected module:factory, the module here or installed") from error
    if not callable(found):
        raise SettingError(f"{name} is {found!r}; expected a function that makes a planner, an agent or a belief")
    return found


def _made(name: str, settings: PlannerSettings, source: str = "") -> Any:
    """What a factory, of a module whose source has this hash, makes of the settings, or of nothing if it needs none."""
    factory = factory_of(name)
    with blaming("entrant", factory):
        taken = inspect.signature(factory).parameters
        needed = any(each.default is each.empty and each.kind <= each.POSITIONAL_OR_KEYWORD for each in taken.values())
        if "settings" in taken:
            return factory(settings=settings)
        return factory(settings) if needed else factory()


def _entered(name: str, known: Known, place: Place) -> Seat:
    """Somebody's own planner, agent or belief, made anew in every process."""
    made, source = _made(name, place.settings), b""
    with suppress(OSError, TypeError):  # there is no file with it
        source = inspect.getsource(import_module(name.partition(":")[0])).encode()
    again = partial(_made, name, place.settings, source=fingerprint(np.frombuffer(source, np.uint8)))
    if isinstance(made, Planner):
        return Seat(known.predictor, again)
    if isinstance(made, Agent):
        return _acting(again, place)
    if isinstance(made, Belief):
        return Seat(made, MpcPlanner(place.settings))
    raise SettingError(
        f"{name} made {made!r}; expected a planner (dt, steps, reset, plan), an agent (reset, act), or a belief "
        "(predict) for our planner"
    )
