"""The planner that drives: in every period the cheapest clear plan among the lanes that can be reached (paper §4).

Each call packs what can be reached into arrays and runs the compiled search, again and again until it has converged or
the time is spent. See `coverdrive.planning.solver.search` for what is searched.
"""

import math
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.arguments import of_kind, period_of
from coverdrive.errors import DataError
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.check.evaluate import Plans, write_slack
from coverdrive.planning.problem.constants import Constants, constants_of
from coverdrive.planning.problem.road_table import RoadTable, table_of
from coverdrive.planning.problem.rollout import after_step
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.tree import held_on, shift_of
from coverdrive.planning.problem.vehicle import SLOW, slow
from coverdrive.planning.rules.approach import approach
from coverdrive.planning.rules.ego_state import assumed_state, continued, plausible
from coverdrive.planning.rules.follower import without_follower
from coverdrive.planning.rules.leaders import Leaders, LeaderSettings, braking, leaders_of
from coverdrive.planning.rules.manners import NONE, MannersSettings
from coverdrive.planning.rules.merging import merge
from coverdrive.planning.rules.path_memory import PathMemory
from coverdrive.planning.rules.target_lanes import TargetLanes, target_lanes
from coverdrive.planning.rules.wish import NO_WISH, Wish
from coverdrive.planning.solver.manoeuvres import accelerations_of
from coverdrive.planning.solver.search import (
    BEGIN,
    CHOOSE,
    EVALUATE,
    GIVE_UP,
    GO_ON,
    IF_ARRIVED,
    NOT_YET,
    Wanted,
    is_compiled,
    room_for,
    search,
)
from coverdrive.planning.surroundings import Surroundings, surroundings_of
from coverdrive.progress import stage
from coverdrive.road import Road
from coverdrive.settings import Settings

_ROUNDING = 1e-9
"""[s] of a time"""
_AT_ONCE, _PATHS_BETWEEN_LOOKS = 8, 1000
"""iterations of the search between two looks at the clock, and paths times iterations: fewer for over 125 paths"""
_WISHED_LANE = 1e4
"""cost of every lane between the one aimed at and the nearest that is wished for, and where none is, of one that ends
within 10 s: more than speed is worth"""


class PlannerSettings(Settings):
    """Everything that decides on a plan."""

    problem: ProblemSettings = ProblemSettings()
    """horizon, ego, weights and obstacles"""
    lane_change: float = Field(default=10.0, ge=0, le=1e6)
    """cost of aiming at another lane than the last plan, against dithering"""
    iterations: int = Field(default=24, ge=1, le=10_000)
    """of the search, at the most"""
    budget: float | None = Field(default=None, gt=0, le=10)
    """[s] wall time after which no further iterations are begun: in a car, half of the time between two plans is a good
    choice; without it, the same seed gives the same drive on every machine"""
    leaders: LeaderSettings = LeaderSettings()
    """what the vehicles directly ahead may do besides, as far as a plan that is clear of it exists"""
    manners: MannersSettings = MannersSettings()
    """distances that are wished for beyond keeping clear"""
    grace: float = Field(default=0.5, ge=0, le=10)
    """[s] for which a vehicle that vanished is taken to be on one of its last predicted paths, and for which the
    ego is taken to follow its last plan where its state cannot be true, or cannot have come about since. Then it brakes
    in the former case, and believes the state in the latter"""


class _Memory(NamedTuple):
    """What the planner remembers of its last call."""

    lane: int
    """the lane that the plan aimed at"""
    state: Float[np.ndarray, " 4"]
    """where the plan leads to by the time of the next call"""
    inputs: dict[int, Float[np.ndarray, "N 2"]]
    """inputs of the best plan to each lane, shifted to the time of the next call"""
    rest: Float[np.ndarray, "K 2"]
    """inputs of the fail-safe branch, shifted as well"""
    unknown: float
    """[s] for which the ego's state has not been known"""


class Call(NamedTuple):
    """What a plan is asked for."""

    state: Float[np.ndarray, " 4"]
    """where the ego is taken to be"""
    road: Road
    wish: Wish
    manners: MannersSettings
    constants: Constants
    """of the problem: calm, hurried or slow"""
    table: RoadTable
    """of the road"""
    slow: bool
    """whether at walking pace"""
    begun: float
    """[s] when, by the clock"""


class _Found(NamedTuple):
    """What a search chose."""

    plans: Plans
    wanted: Wanted
    chosen: int
    """index of the plan"""
    optimised: bool
    """whether it comes out of the descent"""
    best: Float[np.ndarray, "L N 2"]
    """inputs of the best plan to each target lane"""
    around: Surroundings
    """what it was made for"""

    @property
    def clear(self) -> bool:
        """Whether its fail-safe branch is clear."""
        return bool(self.plans.clear[self.chosen])


class MpcPlanner:
    """Model predictive control against every member of every predicted set.

    It implements `coverdrive.plan.Planner`. The first `reset` in a process compiles the search. A planner can
    be pickled and copied: what is compiled belongs to the process, not to the planner.
    """

    def __init__(self, settings: PlannerSettings | None = None):
        """Make a planner.

        Args:
            settings: horizon, ego, weights; the defaults if left out.
        """
        of_kind("settings", settings, (PlannerSettings, type(None)), "PlannerSettings")
        self.settings = settings or PlannerSettings()
        self._accelerations = accelerations_of(self.settings.problem.vehicle)
        self._budget = math.inf if self.settings.budget is None else self.settings.budget
        self._start(self.dt)

    @property
    def dt(self) -> float:
        """[s] between two points of the paths that it plans against."""
        return self.settings.problem.dt

    @property
    def steps(self) -> int:
        """Number K of its steps; it plans against paths of K + 1 points."""
        return self.settings.problem.steps

    def reset(self, period: float) -> None:
        """Forget the previous plan; called before every episode. Compiles what `plan` needs.

        Args:
            period: [s] from one call to the next, by which the last plans are shifted to start the search.

        Raises:
            SettingError: it is less than a millisecond, or more than a second.
        """
        period = period_of(period)
        self._start(period)
        state, road = np.array([0.0, 1.8, 20.0, 0.0]), Road.straight()
        points = np.zeros((1, self.steps + 1, 2))
        points[..., 0] = 3.0  # not clear, so that everything is needed
        self.plan(state, PredictedPaths(points, np.zeros(1, int), np.ones_like(points), self.dt), road)
        self._start(period)

    def compile(self) -> None:
        """Compile the search, as a stage of the work, unless that was done before, in whatever process."""
        if not is_compiled():
            with stage("compiling the planner (once)"):
                MpcPlanner(self.settings).reset(self._period)

    def _start(self, period: float) -> None:
        problem = self.settings.problem
        self._period = period
        hurried = problem.model_copy(update={"cost": problem.cost.hurried()})
        self._calm, self._hurried = constants_of(problem, period), constants_of(hurried, period)
        self._road: Road | None = None
        self._slow: tuple[Constants, RoadTable] | None = None
        self._shift = shift_of(self._calm.tree, period, problem.dt)
        self._held_on = held_on(problem.steps, period, problem.dt)
        self._memory: _Memory | None = None
        self._applied = np.zeros(2)  # acceleration [m/s²] and yaw rate [rad/s] since the last call
        self._paths = PathMemory(self.settings.grace, period)

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, wish: Wish = NO_WISH) -> Plan:
        """Plan from a state against every predicted path.

        Args:
            state: lon [m], lat [m], speed [m/s], heading [rad], one period after the last one. `reset` comes first
                where it is another car's or another drive's.
            paths: predicted paths at the times k·dt of the plan, k = 0 … K.
            road: the lanes to drive on; the same object in every call, or it takes some milliseconds. On one of other
                numbers it plans anew.
            wish: speed and lanes that are wanted this time.

        Returns:
            The cheapest plan whose fail-safe branch is clear of all paths, else the one that does least harm; its
            status says which. If the state or a path is not known, or the state has jumped, the status is
            INVALID_INPUT and the slack 1.

        Raises:
            SettingError: if the paths have other times than the plan, or the road is none.
            DataError: if the state is not of four numbers, nobody can drive on the road, or its lanes are too near to
                the centre of a curve.
        """
        begun, problem = time.perf_counter(), self.settings.problem
        paths.check_times(problem.dt, problem.steps)
        self._look_at(road)
        measured = np.ascontiguousarray(state, dtype=float)
        if measured.shape != (4,):
            raise DataError(f"the state has the shape {measured.shape}; expected (4,): lon, lat, speed and heading")
        believed, memory = plausible(measured, problem.vehicle, road), self._memory
        known, unknown = bool(believed.all()), 0.0
        if known and memory is not None and memory.unknown + self._period <= self.settings.grace + _ROUNDING:
            known = self._continued(measured, memory.state, paths)
        if not known and memory is not None:
            measured, unknown = memory.state, memory.unknown + self._period
        elif not known:
            measured, unknown = assumed_state(measured, believed, problem.vehicle, road), np.inf
        paths, complete = self._paths.completed(paths)
        searching = complete and unknown <= self.settings.grace + _ROUNDING
        manners, constants, table = self.settings.manners, self._hurried if wish.urgent else self._calm, self._table
        slowly = bool(measured[2] < SLOW and manners.like != "paper")
        if slowly:
            constants, table = self._slowly(road)
        call = Call(measured, road, wish, manners, constants, table, slowly, begun)
        found, targets, status = self._decide(call, paths, searching)
        plan = self._plan_of(call, found, status if known and complete else Status.INVALID_INPUT)
        self._remember(call, found, targets, plan, unknown)
        return plan

    def curves(self, road: Road) -> tuple[float, Float[np.ndarray, " R"]] | None:
        """How fast it drives the curves of a road where that is urgent, [m/s] at places so many metres apart.

        None if it has none. Errors as of `plan`.
        """
        self._look_at(road)
        return None if road.line is None else (self._table.road.spacing, self._table.wanted[1])

    def _slowly(self, road: Road) -> tuple[Constants, RoadTable]:
        """The problem at walking pace on the road that it looked at."""
        if self._slow is None:
            problem = self.settings.problem
            problem = problem.model_copy(update={"cost": problem.cost.slow(), "vehicle": slow(problem.vehicle)})
            table = table_of(road, problem)
            self._slow = constants_of(problem, self._period)._replace(vehicle=table.vehicle), table
        return self._slow

    def _look_at(self, road: Road) -> None:
        """Make the table of a road, if it is another one than before, and forget what is in the frame of that."""
        if road is not self._road:
            of_kind("road", road, Road, "a Road").check()
            if self._road is not None and not road.same(self._road):
                self._memory, self._paths = None, PathMemory(self.settings.grace, self._period)
            self._table, self._road, self._slow = table_of(road, self.settings.problem), road, None
            vehicle = self._table.vehicle
            self._calm, self._hurried = (each._replace(vehicle=vehicle) for each in (self._calm, self._hurried))

    def _continued(
        self, state: Float[np.ndarray, " 4"], expected: Float[np.ndarray, " 4"], paths: PredictedPaths
    ) -> bool:
        """Whether the ego has not jumped; where all others have jumped with it, the origin has moved."""
        if continued(state, expected, self._period):
            return True
        offset = np.concatenate([self._paths.shift(paths), np.zeros(2)])
        return continued(state - offset, expected, self._period)

    def _decide(self, call: Call, paths: PredictedPaths, searching: bool) -> tuple[_Found, TargetLanes, Status]:
        """What is chosen, full braking unless ``searching``, among which target lanes, and what it is."""
        settings, horizon, state, road = self.settings, self.steps * self.dt, call.state, call.road
        if settings.problem.obstacles.ignore_rear:
            paths = without_follower(state, paths, road)
        leaders = leaders_of(state, settings.problem.vehicle.length / 2, paths, road)
        targets = target_lanes(state, road, horizon)
        speed = settings.problem.cost.reference_speed if call.wish.speed is None else call.wish.speed
        if call.wish.urgent or call.wish.away(targets.lanes[:1]).any():
            call = call._replace(manners=NONE)
        elif call.manners.like != "paper" and not call.wish.lanes:
            merging = merge(state, paths, road, targets.lanes, settings.problem, call.manners.headway)
            if merging is not None:
                speed = min(speed, merging.speed)
                manners = call.manners.model_copy(update={"headway": merging.headway})
                call = call._replace(manners=manners)
            speed = min(speed, approach(state, paths, road, targets.lanes, leaders))
            call = call._replace(wish=replace(call.wish, speed=speed))
        lost = leaders.lost(targets.lasting, speed, horizon, horizon + settings.leaders.foresight)
        targets = targets._replace(lost=lost)
        own = targets._replace(lanes=targets.lanes[:1], lat=targets.lat[:1])
        if call.slow:
            targets = self._pulled_out(call, targets)
        found = self._clear_of_leaders(call, paths, leaders, targets) if searching else None
        if found is None:
            return self._braking(call, paths, own), own, Status.UNSAFE
        if not found.clear:
            return found, targets, Status.UNSAFE
        return found, targets, Status.SOLVED if found.optimised else Status.FALLBACK

    def _pulled_out(self, call: Call, targets: TargetLanes) -> TargetLanes:
        """The best of the target lanes alone, if it is not the own one.

        Until the end of a plan it would always be better to go straight on than to turn out.
        """
        best = int(np.argmin(self._extra(call.wish, targets, targets.lanes[0])))
        return targets if best == 0 else targets._replace(lanes=[targets.lanes[best]], lat=targets.lat[[best]])

    def _clear_of_leaders(
        self, call: Call, paths: PredictedPaths, leaders: Leaders, targets: TargetLanes
    ) -> _Found | None:
        """What is clear even if vehicles ahead brake hard, unless something is urgent, else what the search chooses for
        the paths alone.
        """
        if call.wish.urgent or len(feared := braking(leaders, paths, self.settings.leaders)) == 0:
            return self._search(call, paths, targets)
        found = self._search(call, paths.joined(feared), targets, giving_up=True)
        if found and found.clear:
            return found
        if found is None or not self._spent(call):
            return self._search(call, paths, targets)
        around = self._around(call, paths)  # in which those ahead do not brake
        search(EVALUATE, found.plans, found.wanted, around, call.constants, found.chosen)
        return found._replace(around=around)

    def _spent(self, call: Call) -> bool:
        """Whether the time is spent that a plan may take."""
        return time.perf_counter() - call.begun > self._budget

    def _search(
        self, call: Call, paths: PredictedPaths, targets: TargetLanes, giving_up: bool = False
    ) -> _Found | None:
        """What the search chooses among the target lanes, of which the first is that of the ego.

        None if it failed, or is ``giving_up`` as nothing is clear soon.
        """
        memory, constants = self._memory, call.constants
        held, nothing = memory.lane if memory else targets.lanes[0], np.zeros((len(constants.tree.parent), 2))
        known = memory.inputs if memory else {}
        wanted = Wanted(
            lanes=call.wish.places(targets.lanes, targets.lat),
            held=targets.lanes.index(held) if held in targets.lanes else 0,
            extra=self._extra(call.wish, targets, held),
            last=np.array([known.get(target, nothing) for target in targets.lanes]),
            rest=memory.rest if memory else np.zeros((self.steps, 2)),
            accelerations=self._accelerations,
        )
        around, plans, best = self._around(call, paths), room_for(wanted, constants), wanted.last.copy()
        chosen, optimised = self._choose(call, plans, wanted, around, giving_up, best)
        return _Found(plans, wanted, chosen, optimised, best, around) if chosen >= 0 else None

    def _choose(
        self, call: Call, plans: Plans, wanted: Wanted, around: Surroundings, giving_up: bool,
        best: Float[np.ndarray, "L N 2"],
    ) -> tuple[int, bool]:  # fmt: skip
        """Let the starts descend until the cheapest has arrived, or the time is spent, and choose."""
        do, left, chosen, optimised = BEGIN + GIVE_UP * giving_up, self.settings.iterations, NOT_YET, False
        at_once = min(_AT_ONCE, max(1, _PATHS_BETWEEN_LOOKS // max(1, around.boxes.shape[2])))
        while chosen == NOT_YET:
            if self._spent(call):
                do, left = do & BEGIN, 0
            now = min(at_once, left)
            left -= now
            do |= (GO_ON if now else 0) | (IF_ARRIVED if left else CHOOSE)
            chosen, optimised = search(do, plans, wanted, around, call.constants, now, best=best)
            do = 0
        return chosen, optimised

    def _extra(self, wish: Wish, targets: TargetLanes, held: int) -> Float[np.ndarray, " L"]:
        """What each target lane costs besides its plan, given the lane that the last plan aimed at."""
        settings, per_lost = self.settings, self.settings.problem.cost.speed / self.settings.problem.dt
        lasting, lost, away = (each.tolist() for each in (targets.lasting, targets.lost, wish.away(targets.lanes)))
        return np.array(
            [
                settings.lane_change * (lane != held)
                + per_lost * lost[lane]
                + _WISHED_LANE * (lanes if wish.lanes else not lasting[lane])
                for lane, lanes in zip(targets.lanes, away, strict=True)
            ]
        )

    def _braking(self, call: Call, paths: PredictedPaths, own: TargetLanes) -> _Found:
        """Full braking in the own lane."""
        around, constants = self._around(call, paths), call.constants
        wanted = Wanted(
            lanes=own.lat,
            held=0,
            extra=np.zeros(1),
            last=np.zeros((1, len(constants.tree.parent), 2)),
            rest=np.zeros((self.steps, 2)),
            accelerations=-np.array([self.settings.problem.vehicle.max_deceleration]),
        )
        plans = room_for(wanted, constants)
        search(BEGIN, plans, wanted, around, constants)
        return _Found(plans, wanted, 0, False, plans.inputs[:1], around)

    def _around(self, call: Call, paths: PredictedPaths) -> Surroundings:
        """What the search is made for."""
        problem = self.settings.problem
        return surroundings_of(call.state, self._applied, paths, call.table, problem, call.wish, call.manners)

    def _plan_of(self, call: Call, found: _Found, status: Status) -> Plan:
        """The chosen plan, on the road."""
        tree, plans, i, state = call.constants.tree, found.plans, found.chosen, call.state
        drive, safe = branches = np.empty((2, self.steps + 1, 4))
        branches[:, 0], drive[1:], safe[1:] = state, plans.states[i, tree.drive], plans.states[i, tree.fail_safe]
        branches[:, 0, 0] = 0.0
        slack = np.zeros(self.steps)
        if status is Status.INVALID_INPUT:
            slack[:] = 1.0
        elif not plans.clear[i]:
            write_slack(safe, found.around, call.constants, slack)
        inputs = plans.inputs[i, tree.drive]
        if not plans.clear[i] and drive[1, 2] <= _ROUNDING:  # stop as early as it can, not at the end of the step
            hardest = min(inputs[0, 0], -min(self._table.vehicle.braking, max(0.0, state[2]) / self._period))
            means = np.maximum(state[2] + self._period / 2 * np.array([inputs[0, 0], hardest]), _ROUNDING)
            inputs[0] = hardest, inputs[0, 1] * means[1] / means[0]  # the wheels stay
        severity = 0.0 if plans.clear[i] else float(plans.severity[i])
        branches[..., 0] += state[0]
        seconds = time.perf_counter() - call.begun
        return Plan(drive, inputs, slack, status, float(plans.cost[i]), seconds, self.dt, severity, safe)

    def _remember(self, call: Call, found: _Found, targets: TargetLanes, plan: Plan, unknown: float) -> None:
        """Keep what the next call needs."""
        inputs = {lane: self._shift @ each for lane, each in zip(targets.lanes, found.best, strict=True)}
        rest = self._held_on @ found.plans.inputs[found.chosen, call.constants.tree.fail_safe]
        self._applied = plan.applied(self._period)
        after = np.array(after_step(tuple(call.state.tolist()), tuple(self._applied.tolist()), self._period))
        lane = targets.lanes[int(found.plans.lane[found.chosen])]
        self._memory = _Memory(lane, after, inputs, rest, unknown)
