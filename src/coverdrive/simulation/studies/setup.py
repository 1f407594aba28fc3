"""What the trials of a study are driven with: who takes part, for how long, and from which seed.

Trial i has its own random numbers, so that it is the same alone and within a study, on any number of processes.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.arguments import of_kind, whole, wholes
from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import StartError, blaming, during, maker_of, name_of
from coverdrive.plan import Planner
from coverdrive.planning.planner import MpcPlanner
from coverdrive.prediction.adaptive import Adaptive
from coverdrive.progress import heard_by
from coverdrive.recordings.recording import Recording
from coverdrive.settings import Settings
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import Row, measure, unstarted
from coverdrive.simulation.predictor import Belief, Predictor, as_given, check_belief
from coverdrive.simulation.roads.initial import VEHICLES, InitialSettings
from coverdrive.simulation.traffic.model import Traffic
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings
from coverdrive.simulation.traffic.registry import TrafficSettings, make_traffic, usual
from coverdrive.simulation.traffic.replay import ReplaySettings, Scenario, hash_of_scenarios

MOST_VEHICLES = 100
"""uncontrolled vehicles at the start of a drive"""

AnyPlanner = Planner | Callable[[], Planner]
"""a planner, or what makes one: solvers that cannot move between processes are made anew in each"""
AnyTraffic = str | TrafficSettings | Traffic | Callable[[], Traffic]
"""the name of a traffic, settings of one, a model of your own, or what makes one"""

Participants = tuple[Belief, Planner, Traffic]
"""who takes part in an episode; built once per process, because solvers cannot move between processes"""


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything that a trial depends on."""

    predictor: Belief
    """of the ego"""
    planner: AnyPlanner = field(default_factory=MpcPlanner)
    """of the ego"""
    traffic: AnyTraffic = "set-sampling"
    """all uncontrolled vehicles"""
    episode: EpisodeSettings = field(default_factory=EpisodeSettings)
    """start, length and time steps"""
    vehicles: Sequence[int] = VEHICLES
    """numbers of uncontrolled vehicles; trial i has the i-th of them, over and over"""
    seed: int = 0
    """trial i draws from ``SeedSequence(seed, spawn_key=(i,))``"""
    scenarios: Sequence[Scenario] | Callable[[], Sequence[Scenario]] = ()
    """recorded scenes for the traffic that replays them, or what reads them when they are needed"""
    recorded: InitialSettings | None = None
    """a start on a road like that of the recordings, if there are any, to tell it from others"""
    sampled: Predictor | None = None
    """whose sets traffic draws from; those of the ego's predictor if left out"""

    def __post_init__(self) -> None:
        """Give the traffic of a name its settings; refuse what makes no trial."""
        traffic = usual(self.traffic) if isinstance(self.traffic, str) else self.traffic
        object.__setattr__(self, "traffic", traffic)
        object.__setattr__(
            self, "vehicles", wholes("numbers of uncontrolled vehicles", self.vehicles, 0, MOST_VEHICLES)
        )
        object.__setattr__(self, "seed", whole("seed", self.seed))
        check_belief(self.predictor)
        _check_part(self.planner, Planner)
        if not isinstance(traffic, Settings):
            _check_part(traffic, Traffic)

    def participants(self) -> Participants:
        """Who takes part, made for this process."""
        scenarios = self._read() if self.replays else ()
        sampled = self.sampled or self.predictor
        sampled = sampled if isinstance(sampled, Predictor) else None
        return self.predictor, made(self.planner, Planner), traffic_of(self.traffic, sampled, scenarios)

    def vehicles_of(self, trial: int) -> int:
        """Number of uncontrolled vehicles of a trial."""
        return self.vehicles[trial % len(self.vehicles)]

    def drive(self, trial: int, participants: Participants | None = None) -> Trace:
        """Drive one trial, and keep all that happens in it; a StartError if the vehicles cannot be placed."""
        seed = np.random.SeedSequence(self.seed, spawn_key=(trial,))
        belief, planner, traffic = participants or self.participants()
        with during(f"in trial {trial} of seed {self.seed}"):
            return run_episode(as_given(belief), planner, traffic, self.episode, self.vehicles_of(trial), seed)

    def row(self, trial: int, participants: Participants) -> Row:
        """Drive one trial, and keep its measures; of one that cannot start, only who it is and why."""
        try:
            with heard_by(None):
                return measure(self.drive(trial, participants), self.seed, trial)
        except StartError as error:
            return unstarted(self.seed, trial, self.vehicles_of(trial), str(error))

    @property
    def replays(self) -> bool:
        """Whether recorded traffic is replayed."""
        return isinstance(self.traffic, ReplaySettings)

    @property
    def foretold(self) -> Sequence[Scenario]:
        """Recorded scenes, once they are read, that go on as they were recorded whatever the ego does."""
        known = self.replays and not isinstance(self.traffic, ReactiveReplaySettings)
        return () if callable(self.scenarios) or not known else self.scenarios

    @property
    def traffic_name(self) -> str:
        """What the traffic is called."""
        return getattr(self.traffic, "kind", None) or name_of(self.traffic)

    def loaded(self) -> "Setup":
        """The same with the recorded scenes read, so that other processes need not."""
        return replace(self, scenarios=tuple(self._read())) if self.replays else self

    def description(self) -> dict[str, Any]:
        """Everything that the result of a trial depends on, as JSON values."""
        return {
            "seed": self.seed,
            "vehicles": list(self.vehicles),
            "episode": self.episode.model_dump(mode="json"),
            "predictor": identity(self.predictor),
            "sampled": identity(self.sampled),
            "planner": described(self.planner),
            "traffic": described(self.traffic),
            "scenarios": hash_of_scenarios(self._read()) if self.replays else None,
        }

    def _read(self) -> Sequence[Scenario]:
        return self.scenarios() if callable(self.scenarios) else self.scenarios


def traffic_of(traffic: AnyTraffic, predictor: Predictor | None, scenarios: Sequence[Scenario] = ()) -> Traffic:
    """A model of one's own, or that of a name or settings, as of `make_traffic`."""
    given: Any = usual(traffic) if isinstance(traffic, str) else traffic
    return made(make_traffic(given, predictor, scenarios) if isinstance(given, Settings) else given, Traffic)  # pyright: ignore[reportArgumentType]


_EXPECTED = {
    Planner: (
        "planner",
        "a planner (dt, steps, reset, plan) or a function that makes one; who acts without paths (reset, act) drives "
        "as AgentPlanner(agent, witness) of coverdrive.league.agents, with its Witness() as the predictor",
    ),
    Traffic: ("traffic", "a name, settings, a traffic model (reset, step) or a function that makes one"),
}


def made(part: Any, kind: type) -> Any:
    """A part as it is, or made by what makes it; a SettingError if that is none of the kind."""
    _check_part(part, kind)
    if _is_made(part, kind):
        return part
    name, expected = _EXPECTED[kind]
    with blaming(name, part):
        return of_kind(name, part(), kind, expected)


def _check_part(part: Any, kind: type) -> None:
    """Refuse what neither is of a kind nor can be called to make one."""
    if not _is_made(part, kind) and not callable(part):
        of_kind(_EXPECTED[kind][0], part, kind, _EXPECTED[kind][1])


def _is_made(part: Any, kind: type) -> bool:
    """Whether a part need not be made; a class has the methods of its objects, but makes them."""
    return isinstance(part, kind) and not isinstance(part, type)


def identity(belief: Belief | str | None) -> Any:
    """What tells beliefs apart: a hash, or else as `described`; of one that adapts around one without a hash, both."""
    known = getattr(belief, "fingerprint", None) or described(belief)
    if isinstance(belief, Adaptive) and not hasattr(belief.predictor, "fingerprint"):
        return {"adapting": known, "predictor": described(belief.predictor)}
    return known


def described(part: Any, within: tuple[int, ...] = ()) -> Any:
    """Settings, numbers, text and what holds them as JSON values, arrays as a hash; of anything else its name, with its
    settings if it has some, and what tells whether it was changed: such of its attributes that have the names of what
    it is made with, also after an underscore, and of what is not of this package a hash of its source, and the
    variables around a function. ``within`` are the ids of what it is a part of, which may be a part of it.
    """
    if isinstance(part, Settings):
        return part.model_dump(mode="json")
    if isinstance(part, np.generic):
        part = part.item()
    if isinstance(part, bool | int | float | str | None):
        return part
    if isinstance(part, bytes | Path | date | set | frozenset | pl.DataFrame | Recording):
        return {name_of(type(part)): _hash_of(part)}
    if id(part) in within:
        return name_of(part)
    inside = (*within, id(part))

    def told(each: Any) -> Any:
        return identity(each) if isinstance(each, Belief) else described(each, inside)

    def each_of(parts: Iterable[tuple[str, Any]]) -> dict[str, Any]:
        return {name: told(each) for name, each in parts}

    if isinstance(part, list | tuple):
        return [told(each) for each in part]
    if isinstance(part, dict):
        return each_of((str(name), each) for name, each in part.items())
    if isinstance(part, np.ndarray) or hasattr(part, "__array__"):
        values = np.asarray(part)
        return described(values.tolist(), inside) if values.dtype == object else {"array": fingerprint(values)}
    if isinstance(part, partial):
        named = each_of(part.keywords.items())
        with_all = [*map(told, part.args), *([named] if named else [])]
        return {"made by": described(part.func, inside), "with": with_all}
    settings = getattr(part, "settings", None)
    if isinstance(part, MpcPlanner):
        return described(settings)
    about: dict[str, Any] = {"settings": described(settings)} if isinstance(settings, Settings) else {}
    made = maker_of(part)
    own = made.__module__.partition(".")[0] == "coverdrive"
    if not own:
        with suppress(OSError, TypeError):  # there is no file with its source
            about["code"] = fingerprint(np.frombuffer(inspect.getsource(made).encode(), np.uint8))
    with suppress(ValueError, TypeError):  # it is not written in Python
        if made is not part:
            about |= each_of(_attributes(part))
        elif inspect.isfunction(made) and not own:
            around, usually = inspect.getclosurevars(made).nonlocals, list(made.__defaults__ or ())
            about |= {"around": each_of(around.items())} if around else {}
            about |= {"usually": described(usually, inside)} if usually else {}
    return {"name": name_of(part), **about} if about else name_of(part)


def _hash_of(values: Any) -> str:
    """A short hash of a table, a recording's table, or other values that say all of themselves."""
    if isinstance(values, Recording):
        return _hash_of(values.table)
    if isinstance(values, pl.DataFrame):
        return fingerprint(values.hash_rows().to_numpy())
    said = sorted(map(repr, values)) if isinstance(values, set | frozenset) else repr(values)
    return fingerprint(np.frombuffer(repr(said).encode(), np.uint8))


def _attributes(part: Any) -> Iterator[tuple[str, Any]]:
    """Those of the names of what an object is made with."""
    for name in inspect.signature(type(part)).parameters:
        for attribute in (name, f"_{name}"):
            if name != "settings" and hasattr(part, attribute):
                yield name, getattr(part, attribute)
                break
