"""Time and cost of planning on recorded instances: `python benchmarks/planner.py [--out planner.json]`.

Instances are recorded while the planner drives trials of the study, in traffic drawn from a predictor that is learnt
from generated traffic (`--predictor` names the file of another one); every tenth and every third of the tight ones are
kept. On the same instances, in the same run:

- *coverdrive*: the planner as it drives, warm: the instances of one drive in their order, prediction apart.
- *reference*: the same problem of two branches, with the lanes that the plan aims at, solved by IPOPT from eight
  starts, one of them the plan; the best merit of them, as the planner evaluates it.
- *the paper's way*: what the paper describes (`coverdrive.league.paper_way`). At every step a nonlinear program is
  built anew in CasADi and solved by IPOPT, here once for the lane of the car, from the recorded plan. It has a cost of
  its own (its ellipses are smaller than the bodies), so that costs are compared with the reference alone.
"""

import argparse
import itertools
import json
import time
from collections import Counter
from pathlib import Path

import numpy as np

from coverdrive.certificates.evaluation import Rate
from coverdrive.config import Experiment
from coverdrive.league.paper_way import Situation, solve_paper_program
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.check.evaluate import Plans, empty_plans, evaluate
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.constants import Constants, constants_of
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.rules.leaders import LeaderSettings, braking, leaders_of
from coverdrive.planning.solver.manoeuvres import accelerations_of, write_manoeuvre
from coverdrive.planning.surroundings import Surroundings, surroundings_of
from coverdrive.prediction.fit import fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.road import Road
from coverdrive.simulation.drivers.generated import generate
from coverdrive.simulation.studies.setup import Setup
from oracle.solvers import SolverSettings, solve

BRAKING = 5  # manoeuvres that slow down: seven starts, and the plan
EXACT = SolverSettings(tolerance=1e-6, max_iterations=500)
PATHS = (10, 30, 60, 119)


def summary(seconds: list[float]) -> dict[str, float]:
    values = 1e3 * np.array(seconds)
    return {
        "median ms": float(np.median(values)),
        "p99 ms": float(np.quantile(values, 0.99)),
        "maximum ms": float(values.max()),
    }


def recorded(experiment: Experiment, predictor: Predictor, trials: int) -> tuple[list[dict], dict]:
    """Instances of closed-loop trials, and how the planner did on all steps."""
    setup = Setup(predictor, MpcPlanner(experiment.planner), episode=experiment.episode, seed=experiment.seed)
    instances, seconds, planning, statuses = [], [], [], Counter()
    for trial in range(trials):
        trace = setup.drive(trial)
        before = np.zeros(2)
        for k, (paths, plan) in enumerate(zip(trace.paths, trace.plans, strict=True)):
            usual, tight = k % 10 == 0, plan.status is not Status.SOLVED
            if usual or (tight and k % 3 == 0):
                state = trace.scene.states[k, 0]
                flags = {"usual": usual, "tight": tight}
                instances.append({"state": state, "paths": paths, "before": before, "plan": plan, **flags})
            before = plan.inputs[0]
            statuses[plan.status.value] += 1
            planning.append(plan.seconds)
        seconds.extend(trace.planning_seconds[1:])
    shares = {status: count / sum(statuses.values()) for status, count in statuses.items()}
    return instances, {
        "prediction and planning": summary(seconds),
        "planning": summary(planning),
        "plans": len(planning),
        "share of each status": shares,
    }


def counted(agrees: np.ndarray) -> dict[str, float]:
    """A share with its interval."""
    if not len(agrees):
        return {"of": 0}
    rate = Rate.of(agrees)
    return {"of": rate.total, "share": rate.value, "low": rate.low, "high": rate.high}


def evaluated(inputs: np.ndarray, targets: np.ndarray, around: Surroundings, constants: Constants) -> Plans:
    """Inputs (m, N, 2) of the tree's nodes to the target lanes (m, 2) of either branch [m], driven and evaluated."""
    plans = empty_plans(*inputs.shape[:2])
    plans.inputs[:], plans.targets[:] = inputs, targets
    evaluate(plans, 0, len(inputs), around, constants)
    return plans


def own_plan(plan: Plan, around: Surroundings, road: Road, constants: Constants) -> Plans:
    """The recorded plan alone, with the lanes as targets for which it is cheapest."""
    inputs = np.empty((len(constants.tree.parent), 2))
    for nodes, states in ((constants.tree.fail_safe, plan.fail_safe), (constants.tree.drive, plan.states)):
        inputs[nodes] = np.diff(states[:, 2:], axis=0) / plan.dt
    pairs = np.array(list(itertools.product(road.centres, road.centres)))
    plans = evaluated(np.repeat(inputs[None], len(pairs), axis=0), pairs, around, constants)
    cheapest = [int(np.argmin(plans.cost))]
    return Plans(*(field[cheapest] for field in plans))


def starts_of(own: Plans, around: Surroundings, problem: ProblemSettings, constants: Constants) -> np.ndarray:
    """Inputs that IPOPT starts from: simple manoeuvres with the least harmful one as fail-safe branch, and the plan."""
    accelerations, tree, ways = accelerations_of(problem.vehicle, BRAKING), constants.tree, []
    for lat in own.targets[0]:
        plans = empty_plans(len(accelerations), len(tree.parent))
        for i, acceleration in enumerate(accelerations):
            write_manoeuvre(plans, i, lat, 0, lat, acceleration, 1.0, 1, around, constants)
        ways.append(plans.inputs)
    alone = evaluated(ways[1], own.targets, around, constants)
    safest = np.lexsort((alone.cost, alone.harm, alone.departure))[0]
    return np.concatenate([np.where(tree.safe[:, None], ways[1][safest], ways[0]), own.inputs])


def reference_costs(instance: dict, problem: ProblemSettings, period: float, road: Road) -> tuple[float, float, float]:
    """Merit of the plan, and the best one of IPOPT from eight starts: of results that do no more harm, and of all.

    A plan that is clear is not worse than one that buys its comfort with contacts; if all do, the second is infinite.
    """
    constants = constants_of(problem, period)
    table = table_of(road, problem)
    state, paths = instance["state"], instance["paths"]
    leaders = leaders_of(state, problem.vehicle.length / 2, paths, road)
    feared = paths.joined(braking(leaders, paths, LeaderSettings()))
    for against in (feared, paths):
        around = surroundings_of(state, instance["before"], against, table, problem)
        own = own_plan(instance["plan"], around, road, constants)
        if own.clear[0]:  # of vehicles that brake ahead, too: that is the problem that it solves
            break
    starts = starts_of(own, around, problem, constants)
    results = [solve(start, own.targets[0], around, problem, period, EXACT) for start in starts]
    found = [each for each in results if each is not None]
    plans = evaluated(np.reshape(found, (len(found), *own.inputs.shape[1:])), own.targets, around, constants)
    alike = (plans.harm <= own.harm) & (plans.departure <= own.departure)
    return float(own.cost[0]), plans.cost[alike].min(initial=np.inf), plans.cost.min(initial=np.inf)


def paper_plan(instance: dict, target: float, road: Road, problem: ProblemSettings) -> tuple[bool, float]:
    """Build and solve the paper's program once: whether IPOPT converged, and the time it took [s]."""
    begin = time.perf_counter()
    edges = float(road.edges[0]), float(road.edges[-1])
    situation = Situation(instance["state"], instance["before"], edges, instance["paths"])
    solution = solve_paper_program(situation, target, instance["plan"].inputs, problem)
    return solution is not None, time.perf_counter() - begin


def scaling(planner: MpcPlanner, instances: list[dict], road: Road) -> dict[str, dict[str, float]]:
    """Planning times against a given number of paths: those of an instance, repeated with small offsets.

    The instances are of different drives, so that there is no last plan to begin with.
    """
    random, result = np.random.default_rng(0), {}
    for count in PATHS:
        seconds = []
        for instance in instances[:200]:
            planner.reset(0.1)
            paths = instance["paths"]
            chosen = np.resize(np.arange(len(paths)), count)
            offset = random.normal(0, 0.2, (count, 1, 2)) * (np.arange(count) >= len(paths))[:, None, None]
            many = PredictedPaths(paths.points[chosen] + offset, paths.vehicle[chosen], paths.half_sizes[chosen], 0.25)
            seconds.append(planner.plan(instance["state"], many, road).seconds)
        result[f"{count} paths"] = summary(seconds)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--predictor", type=Path)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--compared", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("planner.json"))
    arguments = parser.parse_args()
    experiment = Experiment()
    if arguments.predictor:
        predictor = Predictor.load(arguments.predictor)
    else:
        recordings = generate(experiment.generated, experiment.seed)
        predictor = fit(recordings, experiment.prediction, experiment.seed).predictor
    problem, road = experiment.planner.problem, experiment.episode.initial.road()
    instances, driven = recorded(experiment, predictor, arguments.trials)
    instances = [instance for instance in instances if len(instance["paths"])]
    chosen = np.random.default_rng(0).permutation(len(instances))[: arguments.compared]
    compared = [instances[i] for i in chosen]
    period = experiment.episode.step
    costs = [reference_costs(each, problem, period, road) for each in compared]
    own, best, best_of_all = np.array(costs).T
    usual, tight = (np.array([each[flag] for each in compared]) for flag in ("usual", "tight"))
    known = np.isfinite(best)
    kinds = {
        "of every tenth plan": usual,
        "of those that are solved": ~tight,
        "of those that are not": tight,
    }
    paper = [
        paper_plan(each, float(road.centres[int(road.lane_of(each["state"][1]))]), road, problem) for each in compared
    ]
    baseline = summary([seconds for _, seconds in paper])
    result = {
        "coverdrive": driven,
        "paths per instance": float(np.mean([len(each["paths"]) for each in compared])),
        "cost at most 1 % above IPOPT's best of eight starts": {
            name: {
                "doing no more harm": counted((own <= 1.01 * best)[kind & known]),
                "doing any harm": counted((own <= 1.01 * best_of_all)[kind & np.isfinite(best_of_all)]),
                "IPOPT found none doing no more harm": int((kind & ~known).sum()),
            }
            for name, kind in kinds.items()
        },
        "cost over IPOPT's best doing no more harm, median, 90th and 95th percentile": np.quantile(
            (own / best)[known], [0.5, 0.9, 0.95]
        ).tolist(),
        "the paper's way": baseline | {"converged": float(np.mean([converged for converged, _ in paper]))},
        "times faster, medians": baseline["median ms"] / driven["planning"]["median ms"],
        "times faster, p99": baseline["p99 ms"] / driven["planning"]["p99 ms"],
        "number of paths": scaling(MpcPlanner(experiment.planner), compared, road),
    }
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
