"""The first things on the page: the numbers that count, and where everything comes from."""

import re
from dataclasses import dataclass

import numpy as np
import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Rate
from coverdrive.numbers import at_most, interval, percent
from coverdrive.planning.plan import Status
from coverdrive.report.claim import strength, whose
from coverdrive.report.contents import Contents
from coverdrive.report.page.study import plan_share
from coverdrive.simulation.statistics import collision_table, miss_rate


@dataclass(frozen=True)
class Tile:
    """One number."""

    value: str
    label: str
    note: str


def heading(contents: Contents) -> str:
    """What was run, in a few words."""
    names = [recording["name"] for recording in contents.run["recordings"]]
    generated = all(re.fullmatch(r"generated \d+", name) for name in names)
    learned = "generated traffic" if generated else names[0] if len(names) == 1 else f"{len(names)} recordings"
    trials = "" if contents.trials is None else f", {contents.trials.height} closed-loop trials"
    return f"coverdrive on {learned}{trials}"


def tiles(contents: Contents) -> list[Tile]:
    """The numbers that count."""
    certified, basis = contents.certified, contents.predictor.basis
    certificate, evaluation = certified.certificates[0], certified.evaluation
    observed = evaluation.vehicles if certificate.unit == "vehicle" else evaluation.windows
    shown = [
        Tile(f"≤ {at_most(certificate.epsilon, 3)}", _bounded(certificate), strength(certificate)),
        Tile(percent(observed.value), f"{certificate.unit}s missed on unseen scenes", _counted(observed)),
        Tile(
            f"{evaluation.mean_set_size:.1f} of {len(basis)}", "possible manoeuvres", "mean size of the predicted set"
        ),
    ]
    if contents.trials is not None:
        shown += _study_tiles(contents.trials, contents.period)
    return shown


def _bounded(certificate: Certificate) -> str:
    """What is missed at most so often."""
    return f"{certificate.unit}s missed" if certificate.groups == 1 else f"missed of {whose(certificate)}"


def _study_tiles(trials: pl.DataFrame, period: float) -> list[Tile]:
    total = collision_table(trials).row(-1, named=True)
    collisions = total["frontal_or_side"] + total["rear_end"]
    rate = Rate.of(np.arange(total["trials"]) < collisions)
    missed = miss_rate(trials, "prediction_misses", "windows")
    median = 1e3 * float(np.median(trials["planning_median"].to_numpy()))
    return [
        Tile(f"{collisions} of {total['trials']}", "drives with a collision", f"95 %: {interval(rate.low, rate.high)}"),
        Tile(f"{trials['mean_speed'].to_numpy().mean():.1f} m/s", "mean speed of the own car", "over all trials"),
        Tile(
            percent(missed.missed / max(missed.total, 1)),
            "windows missed in the drives",
            f"{missed.missed} of {missed.total}; 95 %: {interval(missed.low, missed.high)}",
        ),
        Tile(
            percent(plan_share(trials, Status.SOLVED, Status.FALLBACK)),
            "plans clear of every predicted path",
            f"unsafe: {percent(plan_share(trials, Status.UNSAFE))}; rear: {percent(plan_share(trials, Status.REAR))}",
        ),
        Tile(f"{median:.0f} ms", "per prediction and plan", f"median; due every {1e3 * period:g} ms"),
    ]


def facts(contents: Contents) -> list[tuple[str, str]]:
    """What was learned from what, line by line."""
    certified, basis, run = contents.certified, contents.predictor.basis, contents.run
    evaluation, samples = certified.evaluation, certified.samples
    recordings = run["recordings"]
    rows = sum(recording["rows"] for recording in recordings)
    return [
        ("recordings", f"{len(recordings)} with {rows} rows in all"),
        ("segments", f"{samples['segments']} of {basis.horizon:g} s: {samples['train']} to train, "
         f"{samples['calibration']} to calibrate, {samples['test']} to test; {samples['dropped']} left out"),
        ("base trajectories", f"{len(basis)} (ε = {basis.radius:g}; all training segments are covered)"),
        ("missed test windows", str(evaluation.windows)),
        ("missed test vehicles", str(evaluation.vehicles)),
        ("not predicted / outside the tube", f"{evaluation.not_predicted} / {evaluation.outside_tube} test windows"),
        ("test windows that no base covers", str(certified.uncovered)),
        ("set size", f"mean {evaluation.mean_set_size:.2f}, median {evaluation.median_set_size:g} of {len(basis)}"),
        ("time", ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in run["seconds"].items())),
        ("software", f"coverdrive {run['coverdrive']}, Python {run['python']}, "
         + ", ".join(f"{name} {version}" for name, version in run["packages"].items())),
        ("seed", str(run["seed"])),
    ]  # fmt: skip


def _counted(rate: Rate) -> str:
    return f"{rate.count} of {rate.total}; 95 %: {interval(rate.low, rate.high)}"
