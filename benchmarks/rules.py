"""What does each rule of the planner pay? `python benchmarks/rules.py --recording commonroad/ [--drives 100]`.

Every rule is switched off by itself, on equal seeds: among drivers, among aggressive ones, among both where each is
unseen on a tenth of its way, 8 m at a time, in highway-env at density 2, in replays of recorded scenes, half of which
drive on what was learned from the other half, with which they share no vehicle, and in random emergencies with known
futures. Of each: drives that end in contact, those at the ego's fault, the difference in mean speed with its paired
95 % interval (none of replays, which depend on each other), unsafe plans, and manners. Beside them stand bodies that
keep their velocity, the least that one can believe, and the known future, the most. ``--write`` puts the table into
`benchmarks/RESULTS.md`.
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

import coverdrive
from coverdrive.bridges.world import drive as watch
from coverdrive.driving.driver import Driver
from coverdrive.league.beliefs import ConstantVelocity, KnownFuture
from coverdrive.league.others import OTHERS
from coverdrive.paths import PredictedPaths
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.rules.leaders import Leaders
from coverdrive.prediction.data.split import Split
from coverdrive.prediction.fit import PredictionSettings, cut_and_split, fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.fault import Fault
from coverdrive.simulation.drives.outcome import Cause, Kind
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.studies.comparison import mean_interval
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.replay import cut_scenarios
from random_emergencies import compared, emergencies, row_of
from results import save, write_section

ALL = "all rules"
SECOND_PATH = "second path of lane changes"
ENTERING = "who comes in brakes"
VELOCITY, FUTURE = "sets, but constant velocity", "sets, but the future is known"
WITHOUT: dict[str, dict[str, Any]] = {
    ALL: {},
    "leaders that brake": {"leaders": {"deceleration": 0.0}},
    ENTERING: {},
    "foresight": {"leaders": {"foresight": 0.0}},
    "manners": {"manners": {"like": "paper"}},
    "calm lane changes": {"manners": {"sideways": 10.0}},
    "cost of another lane": {"lane_change": 0.0},
    "grace": {"grace": 0.0},
    SECOND_PATH: {},
    VELOCITY: {},
    FUTURE: {},
}
UNSEEN = ", at times unseen"
GENERATED = {"drivers": (3, 4, 5, 6, 7), "aggressive": (8, 9, 10, 11, 12)}
TRAFFICS = {**GENERATED, **{name + UNSEEN: each for name, each in GENERATED.items()}, "fold 1": (1,), "fold 2": (1,)}
HIGHWAY, EMERGENCIES = "highway-env-2", "emergencies"
WORLDS = (*TRAFFICS, HIGHWAY, EMERGENCIES)
OF_SETS = {SECOND_PATH, VELOCITY, FUTURE}


@dataclass(frozen=True)
class Single:
    """A predictor without the second paths of vehicles that change lanes."""

    predictor: Predictor

    @property
    def fingerprint(self) -> str:
        """A short hash."""
        return f"single {self.predictor.fingerprint}"

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """The first paths."""
        paths = self.predictor.predict(scene, road, ego, dt, steps)
        return paths if paths.weight is None else paths.of(paths.weight == 1)


@dataclass(frozen=True)
class Failing:
    """A predictor to which every vehicle is unseen on a tenth of its way, 8 m at a time, whatever else drives."""

    predictor: Predictor

    @property
    def fingerprint(self) -> str:
        """A short hash."""
        return f"failing {self.predictor.fingerprint}"

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """The paths of those that are seen."""
        paths = self.predictor.predict(scene, road, ego, dt, steps)
        stretch = (np.asarray(scene.lon)[paths.vehicle] // 8).astype(np.int64)
        return paths.of((stretch * 7919 + paths.vehicle * 104_729) % 1009 % 10 > 0)


class OfLanes(MpcPlanner):
    """A planner that fears braking only of those ahead in their lanes, of nobody who is to come in."""

    def _clear_of_leaders(self, state: Any, paths: PredictedPaths, leaders: Leaders, *others: Any) -> Any:
        return super()._clear_of_leaders(state, paths, leaders._replace(entering=leaders.entering[:0]), *others)


@lru_cache(maxsize=4)
def planner_without(rule: str, world: str = "") -> MpcPlanner:
    """The planner, in others' world that of the league there, with one rule switched off."""
    settings = OTHERS[world].settings(PlannerSettings()) if world else PlannerSettings()
    usual = settings.model_dump()
    changed = {name: usual[name] | part if isinstance(part, dict) else part for name, part in WITHOUT[rule].items()}
    planner = OfLanes if rule == ENTERING else MpcPlanner
    return planner(PlannerSettings.model_validate(usual | changed))


@lru_cache(maxsize=4)
def setup_of(folder: Path, rule: str, traffic: str, seed: int, recordings: tuple[Path, ...]) -> Setup:
    """Of one rule switched off, in one traffic."""
    predictor = Predictor.load(folder / f"{traffic if 'fold' in traffic else 'generated'}.safetensors")
    planner = planner_without(rule)
    known = {SECOND_PATH: Single(predictor), VELOCITY: ConstantVelocity()}.get(rule, predictor)
    if "fold" not in traffic:
        seen = Failing(known) if UNSEEN in traffic else known
        name = traffic.removesuffix(UNSEEN)
        return Setup(seen, planner, name, vehicles=TRAFFICS[traffic], seed=seed, sampled=predictor)
    own = set(json.loads((folder / f"{traffic}.json").read_text()))
    scenes = cut_scenarios([each for each in coverdrive.read(list(recordings)) if each.name in own])
    known = KnownFuture(scenes) if rule == FUTURE else known
    return Setup(known, planner, "replay", vehicles=(1,), seed=seed, scenarios=scenes, sampled=predictor)


def drive(folder: Path, rule: str, traffic: str, seed: int, trial: int, recordings: tuple[Path, ...]) -> dict[str, Any]:
    """The row of one drive."""
    if traffic == EMERGENCIES:
        return row_of(planner_without(rule), *next(emergencies((seed * 1000 + trial) * 1000)))
    if traffic == HIGHWAY:
        other, setup = OTHERS[HIGHWAY], setup_of(folder, rule, "drivers", seed, recordings)
        world = other.make()
        driver = Driver(setup.predictor, planner_without(rule, HIGHWAY), period=world.car.period)
        return measure(watch(world, driver, seed * 10_000 + trial), seed, trial) | {"reason": ""}
    setup = setup_of(folder, rule, traffic, seed, recordings)
    return setup.row(trial, participants(folder, rule, traffic, seed, recordings))


@lru_cache(maxsize=4)
def participants(*of: Any) -> Any:
    return setup_of(*of).participants()


def prepare(folder: Path, recordings: tuple[Path, ...]) -> None:
    """Fit on generated traffic, and on either half of the recorded scenes, whose vehicles train and calibrate."""
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "generated.safetensors").exists():
        fit(coverdrive.generate()).predictor.save(folder / "generated.safetensors")
    if not recordings or (folder / "fold 2.safetensors").exists():
        return
    read, settings = coverdrive.read(list(recordings)), PredictionSettings()
    segments, sides = cut_and_split(read, settings, 0)
    if not sides.crossed:
        raise SystemExit("the recordings do not fall into two groups that share no vehicle")
    for number, (own, other) in enumerate(((sides.train, sides.calibration), (sides.calibration, sides.train)), 1):
        dealt = np.random.default_rng(0).permutation(np.unique(segments.vehicle[own]))
        train = np.isin(segments.vehicle[own], dealt[: int(0.6 * len(dealt))])
        split = Split(own[train], own[~train], own[~train], 0)
        fit(read, settings, 0, epsilon="auto", sides=split).predictor.save(folder / f"fold {number}.safetensors")
        names = sorted({read[index].name for index in np.unique(segments.recording[other])})
        (folder / f"fold {number}.json").write_text(json.dumps(names))


def summary(rows: list[dict[str, Any]], base: list[dict[str, Any]], replayed: bool) -> dict[str, Any]:
    """What drives came to, against those with all rules on the same seeds; of replays without an interval."""
    if "planner" in rows[0]:
        return compared(rows)
    both = [(ours, theirs) for ours, theirs in zip(rows, base, strict=True) if not ours["reason"] + theirs["reason"]]
    ours = [each for each, _ in both]
    column = {name: np.array([each[name] for each in ours], float) for name in (
        "mean_speed", "share_unsafe", "usual_headway", "minimum_time_to_collision", "jerk_longitudinal")}  # fmt: skip
    apart = column["mean_speed"] - np.array([each["mean_speed"] for _, each in both])
    touched = [each for each in ours if each["kind"] != Kind.FINISHED.value]
    return {
        "drives": len(ours),
        "contacts": len(touched),
        "own fault": sum(each["at_fault"] == Fault.EGO.value for each in touched),
        "hopeless starts": sum(each["cause"] == Cause.START.value for each in touched),
        "mean speed": float(column["mean_speed"].mean()),
        "faster by": (None, None) if replayed else mean_interval(apart, 0.95),
        "unsafe": float(column["share_unsafe"].mean()),
        "headway in nine of ten moments": float(np.nanmedian(column["usual_headway"])),
        "within 1 s of collision": float((column["minimum_time_to_collision"] < 1).mean()),
        "jerk": float(column["jerk_longitudinal"].mean()),
    }


def table(found: dict[str, dict[str, dict[str, Any]]]) -> str:
    """Rows are rules that were switched off."""
    lines = []
    for traffic, rules in found.items():
        if traffic == EMERGENCIES:
            by = [f"by the {contact} contact" for contact in ("first", "hardest")]
            counts = [key for key in rules[ALL] if key not in ("scenes", *by)]
            worse = [f"worse than {than}, {each}" for each in by for than in ("full braking", "the best of 40")]
            lines += [f"\nRandom emergencies, {rules[ALL]['scenes']} a row:\n"]
            lines += [f"| without | {' | '.join([*counts, *worse])} | mean |", "|---" * (len(counts + worse) + 2) + "|"]
            for rule, each in rules.items():
                told = [each[key] for key in counts]
                told += [
                    each[one][key] for one in by for key in ("worse than full braking", "worse than the best of 40")
                ]
                mean = each[by[0]]["mean [m/s]"]["planner"]
                lines += [f"| {_name(rule)} | {' | '.join(map(str, told))} | {mean:.2f} m/s |"]
            continue
        lines += [f"\n`{traffic}`, {rules[ALL]['drives']} drives a row:\n"]
        lines += ["| without | contacts (own fault; from hopeless starts) | mean speed [m/s] (paired 95 %) | unsafe | headway [s] | < 1 s to collision | jerk [m/s³] |"]  # fmt: skip  # noqa: E501
        lines += ["|---|---|---|---|---|---|---|"]
        for rule, each in rules.items():
            told = rule != ALL and None not in each["faster by"]
            apart = " ({:+.2f} … {:+.2f})".format(*each["faster by"]) if told else ""
            lines += [f"| {_name(rule)} | {each['contacts']} ({each['own fault']}; {each['hopeless starts']}) | {each['mean speed']:.2f}{apart} | {each['unsafe']:.2%} | {each['headway in nine of ten moments']:.2f} | {each['within 1 s of collision']:.0%} | {each['jerk']:.2f} |"]  # fmt: skip  # noqa: E501
    return "\n".join(lines)


def _name(rule: str) -> str:
    return "nothing" if rule == ALL else rule


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path, nargs="*", default=[])
    parser.add_argument("--rules", nargs="+", choices=WITHOUT, default=list(WITHOUT))
    parser.add_argument("--traffics", nargs="+", choices=WORLDS, default=list(WORLDS))
    parser.add_argument("--drives", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=Path(gettempdir()) / "coverdrive-rules", help="of fits and rows")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    parser.add_argument("--title", default="Rules of the planner, each switched off", help="of the section")
    given = parser.parse_args()
    recordings = tuple(given.recording)
    prepare(given.folder, recordings)
    traffics = [each for each in given.traffics if recordings or "fold" not in each]
    found: dict[str, dict[str, dict[str, Any]]] = {}
    with ProcessPoolExecutor(given.workers, get_context("spawn")) as pool:
        for traffic in traffics:
            rows: dict[str, list[dict[str, Any]]] = {}
            for rule in dict.fromkeys([ALL, *given.rules]):
                if rule in OF_SETS and (traffic == EMERGENCIES or (rule == FUTURE and "fold" not in traffic)):
                    continue
                kept = given.folder / f"{traffic}, {rule}, {given.seed}, {given.drives}.json"
                if not kept.exists():
                    runs = [
                        pool.submit(drive, given.folder, rule, traffic, given.seed, trial, recordings)
                        for trial in range(given.drives)
                    ]
                    kept.write_text(json.dumps([run.result() for run in runs], default=float))
                rows[rule] = json.loads(kept.read_text())
                found.setdefault(traffic, {})[rule] = summary(rows[rule], rows[ALL], "fold" in traffic)
                print(traffic, "without", rule, found[traffic][rule], flush=True)
    print(table(found))
    if given.write:
        write_section(given.title, __doc__, table(found))
    if given.save:
        save(given.save, found, given.seed)


if __name__ == "__main__":
    main()
