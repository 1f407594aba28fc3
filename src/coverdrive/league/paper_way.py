"""The paper's way to plan: its optimal control problem (§4), built anew in CasADi for every plan and solved by IPOPT.

`solve_paper_program` is the program, `PaperPlanner` drives with it. What the paper says is followed:

- Variables are the states, inputs and slacks of all steps; the Euler steps of the Dubins car are constraints.
- One plain ellipse for every predicted path and step (k = 1 … K; no plan changes k = 0), its semi-axes the sums of the
  two cars' half sizes; such an ellipse does not contain the corners of the boxes. The half sizes of the other car
  include its tube ("contains the predicted future position […] with the error bound").
- One slack γ_k for all ellipses of a step, of either sign, that costs c_k·γ_k².
- Every vehicle counts, the one directly behind as well, unless `ignore_rear` is set (Remark 2).
- The first input is applied, and everything is solved again from the next state.

What the paper leaves open:

- *The solver's form.* The authors' scripts write each ellipse as an equality: a variable of its own, at least 1, is
  what the ellipse and γ_k give. That is done here.
- *The costs h and Q, the weights c_k, the bounds U.* They are those of the package's problem, so that both planners
  want the same; its bound of the lateral acceleration is none of the paper's. As in the scripts, the car is held inside
  the road, here with its sides; nothing else bounds the state.
- *The lane.* The paper poses one problem and says that the planner is "designed to perform lane changes and overtaking
  maneuvers", but not what it aims at; the scripts aim at one fixed place on the road. Here there is a program for the
  own lane and for each beside it, and the cheapest is driven, changes of the aim priced as by the package's planners.
- *The start of the solver.* As in the scripts, the last solution, here shifted by the time since and driven with the
  model; going straight on if there is none.
- *A solver that fails.* As in the scripts, a second attempt without the last solution, then no input at all.

P = K + 1 is the number of states, n that of the predicted paths.
"""

import itertools
import time
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.extras import require
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.tree import held_on
from coverdrive.planning.rules.follower import without_follower
from coverdrive.road import Road

ca: Any = require("casadi")

_MAX_YAW_RATE = 0.5
"""[rad/s] own choice"""
NEGLIGIBLE = 0.01
"""slack that does not count: half a percent of the way to the centre. A quadratic penalty leaves some at every ellipse
that a plan touches"""


class Situation(NamedTuple):
    """What the program is posed for."""

    state: Float[np.ndarray, " 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] now"""
    previous_input: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied before"""
    road_edges: tuple[float, float]
    """[m] lat of the right and of the left edge of the road"""
    paths: PredictedPaths
    """every predicted path, however far away"""


class Solution(NamedTuple):
    """What the program gives."""

    states: Float[np.ndarray, "P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad]"""
    inputs: Float[np.ndarray, "K 2"]
    """acceleration [m/s²], yaw rate [rad/s]"""
    slack: Float[np.ndarray, " K"]
    """γ_k of the steps k = 1 … K"""
    cost: float
    """value of the objective"""


def solve_paper_program(
    situation: Situation, target_lat: float, start: Float[np.ndarray, "K 2"], problem: ProblemSettings
) -> Solution | None:
    """Build the program and solve it once; None if IPOPT does not converge.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the target lane.
        start: the inputs that IPOPT starts from.
        problem: horizon, ego and weights.
    """
    quiet = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
    program = _program(situation, target_lat, problem)
    solver = ca.nlpsol("paper", "ipopt", program, quiet | {"ipopt": {"print_level": 0, "sb": "yes"}})
    low, high = _bounds(situation, problem)
    result = solver(x0=_start(situation, start, problem), lbx=low, ubx=high, lbg=0.0, ubg=0.0)
    values = np.asarray(result["x"]).ravel()
    if not solver.stats()["success"] or not np.isfinite(values).all():
        return None
    return _solution(situation, values, float(result["f"]), problem.steps)


def coasting(situation: Situation, target_lat: float, problem: ProblemSettings) -> Solution:
    """No input, with the slack and the cost that the program would give it."""
    program, values = _program(situation, target_lat, problem), _start(situation, np.zeros((problem.steps, 2)), problem)
    cost = ca.Function("cost", [program["x"]], [program["f"]])(values)
    return _solution(situation, values, float(cost), problem.steps)


def _solution(situation: Situation, values: Float[np.ndarray, " V"], cost: float, steps: int) -> Solution:
    """What values of the variables are."""
    inputs, later, slack = np.split(values[: 7 * steps], [2 * steps, 6 * steps])
    states = np.concatenate([situation.state[None], later.reshape(-1, 4)])
    return Solution(states, inputs.reshape(-1, 2), slack, cost)


def _program(situation: Situation, target_lat: float, problem: ProblemSettings) -> dict[str, Any]:
    """Variables x, objective f and constraints g = 0; x holds inputs, states, slacks and what each ellipse gives."""
    steps, paths, axes = problem.steps, situation.paths, _axes(situation.paths, problem)
    inputs = [ca.SX.sym(f"u_{k}", 2) for k in range(steps)]
    states = [ca.SX(situation.state), *(ca.SX.sym(f"x_{k}", 4) for k in range(1, steps + 1))]
    slack, levels = ca.SX.sym("slack", steps), [ca.SX.sym(f"level_{k}", len(paths)) for k in range(1, steps + 1)]
    weights, cost, constraints, last = problem.cost.slack_weights(steps), 0, [], situation.previous_input
    for k, (state, after) in enumerate(itertools.pairwise(states)):
        constraints.append(after - euler_step(state, inputs[k], problem.dt))
        constraints.append(_ellipses(after[0], after[1], paths.points[:, k + 1], axes[:, k]) + slack[k] - levels[k])
        cost += step_cost(after, inputs[k], last, target_lat, k == steps - 1, problem.cost) + weights[k] * slack[k] ** 2
        last = inputs[k]
    return {"x": ca.vertcat(*inputs, *states[1:], slack, *levels), "f": cost, "g": ca.vertcat(*constraints)}


def euler_step(state: Any, inputs: Any, dt: float) -> Any:
    """The Euler step of the Dubins car: the state after the inputs were held for dt [s]."""
    speed, heading = state[2], state[3]
    return state + dt * ca.vertcat(speed * ca.cos(heading), speed * ca.sin(heading), inputs)


def euler_rollout(
    state: Float[np.ndarray, " 4"], inputs: Float[np.ndarray, "K 2"], dt: float
) -> Float[np.ndarray, "P 4"]:
    """The states that inputs, each held for dt [s], lead to in Euler steps; the first is the given one."""
    states = [ca.DM(state)]
    for each in inputs:
        states.append(euler_step(states[-1], ca.DM(each), dt))
    return np.asarray(ca.horzcat(*states)).T


def step_cost(state: Any, inputs: Any, last: Any, target_lat: float, terminal: bool, cost: CostSettings) -> Any:
    """What a step costs without its slack, that leads to a state after the inputs of the last one."""
    change = inputs - last
    errors = cost.lane * (state[1] - target_lat) ** 2 + cost.speed * (state[2] - cost.reference_speed) ** 2
    errors += cost.heading * state[3] ** 2
    applied = cost.acceleration * inputs[0] ** 2 + cost.yaw_rate * inputs[1] ** 2
    changed = cost.acceleration_change * change[0] ** 2 + cost.yaw_rate_change * change[1] ** 2
    return (cost.terminal if terminal else 1.0) * errors + applied + changed


def _axes(paths: PredictedPaths, problem: ProblemSettings) -> Float[np.ndarray, "n K 2"]:
    """Semi-axes [m] of the ellipses."""
    return paths.half_sizes[:, 1:] + problem.vehicle.half_sizes


def _ellipses(lon: Any, lat: Any, centres: Float[np.ndarray, "*m n 2"], axes: Float[np.ndarray, "*m n 2"]) -> Any:
    """Left-hand sides of the obstacle constraints, without slack: below 1 inside an ellipse."""
    ahead, aside = (lon - centres[..., 0]) / axes[..., 0], (lat - centres[..., 1]) / axes[..., 1]
    return ahead**2 + aside**2


def _bounds(situation: Situation, problem: ProblemSettings) -> tuple[Float[np.ndarray, " V"], Float[np.ndarray, " V"]]:
    """Lower and upper bounds of the variables in their order: inputs, states, slacks, what each ellipse gives."""
    steps, car, free = problem.steps, problem.vehicle, np.full(problem.steps, np.inf)
    right, left = situation.road_edges
    levels = np.ones(steps * len(situation.paths))
    low = ([-car.max_deceleration, -_MAX_YAW_RATE], [-np.inf, right + car.width / 2, -np.inf, -np.inf])
    high = ([car.max_acceleration, _MAX_YAW_RATE], [np.inf, left - car.width / 2, np.inf, np.inf])
    return (
        np.concatenate([*(np.tile(each, steps) for each in low), -free, levels]),
        np.concatenate([*(np.tile(each, steps) for each in high), free, np.inf * levels]),
    )


def _start(situation: Situation, inputs: Float[np.ndarray, "K 2"], problem: ProblemSettings) -> Float[np.ndarray, " V"]:
    """Values of all variables for given inputs, with the smallest slack; with them the constraints hold."""
    states, paths = euler_rollout(situation.state, inputs, problem.dt), situation.paths
    levels = _ellipses(states[1:, 0], states[1:, 1], paths.points[:, 1:], _axes(paths, problem)).T
    slack = np.maximum(0.0, 1.0 - levels.min(axis=1, initial=1.0))
    return np.concatenate([inputs.ravel(), states[1:].ravel(), slack, (levels + slack[:, None]).ravel()])


class PaperPlanner:
    """Model predictive control the paper's way; implements `coverdrive.plan.Planner`."""

    def __init__(self, problem: ProblemSettings, lane_change: float):
        """Make a planner.

        Args:
            problem: horizon, ego and weights; of the obstacles' settings, ``ignore_rear`` alone matters.
            lane_change: cost of aiming at another lane than the last plan.
        """
        self.problem, self.lane_change = problem, lane_change
        self.dt, self.steps = problem.dt, problem.steps
        self.reset(self.dt)

    def reset(self, period: float) -> None:
        """Forget the previous plan; called before every episode with the time [s] between two plans."""
        self._held_on = held_on(self.steps, period, self.dt)
        self._lane: int | None = None  # that the last plan aimed at
        self._applied = np.zeros(2)  # acceleration [m/s²] and yaw rate [rad/s] since
        self._inputs: dict[int, Float[np.ndarray, "K 2"]] = {}  # to each lane, shifted to the time of the next plan

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state against every predicted path; the state and the paths must be finite.

        Args:
            state: lon [m], lat [m], speed [m/s], heading [rad].
            paths: predicted paths at the times k·dt of the plan, k = 0 … K.
            road: the lanes to drive on.

        Returns:
            The cheapest plan; SOLVED if its slack is negligible, else UNSAFE. No input, and UNSAFE, where IPOPT fails
            for every lane. Its slack is that of the program, which the quadratic penalty leaves above 0 wherever the
            plan touches an ellipse.

        Raises:
            SettingError: if the paths have other times than the plan.
        """
        begin = time.perf_counter()
        problem = self.problem
        paths.check_times(problem.dt, problem.steps)
        if problem.obstacles.ignore_rear:
            paths = without_follower(state, paths, road)
        edges = float(road.edges[0]), float(road.edges[-1])
        situation = Situation(state, self._applied, edges, paths)
        lane = int(road.lane_of(state[1]))
        held = lane if self._lane is None else self._lane
        found = self._solutions(situation, road, lane)
        target = min(found, key=lambda each: found[each].cost + self.lane_change * (each != held), default=lane)
        chosen = found[target] if found else coasting(situation, float(road.centres[lane]), problem)
        self._lane, self._applied = target, chosen.inputs[0]
        self._inputs = {each: self._held_on @ one.inputs for each, one in found.items()}
        slack = np.maximum(0.0, chosen.slack)
        status = Status.SOLVED if found and slack.max() <= NEGLIGIBLE else Status.UNSAFE
        seconds = time.perf_counter() - begin
        return Plan(chosen.states, chosen.inputs, slack, status, chosen.cost, seconds, problem.dt)

    def _solutions(self, situation: Situation, road: Road, lane: int) -> dict[int, Solution]:
        """The plans to the own lane and to those beside it, by lane; without those for which IPOPT fails."""
        problem, former, straight = self.problem, self._inputs, np.zeros((self.steps, 2))
        solutions: dict[int, Solution] = {}
        for target in range(max(lane - 1, 0), min(lane + 2, road.lanes)):
            for start in [former[target], straight] if target in former else [straight]:
                solution = solve_paper_program(situation, float(road.centres[target]), start, problem)
                if solution is not None:
                    solutions[target] = solution
                    break
        return solutions
