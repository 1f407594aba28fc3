"""The page in words: the numbers that count, how the drives of the study ended, and where everything comes from."""

import re
from typing import NamedTuple

import numpy as np
import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Rate
from coverdrive.numbers import at_most, interval, percent
from coverdrive.plan import Status
from coverdrive.reporting.claim import set_facts, strength, whose
from coverdrive.reporting.contents import Contents
from coverdrive.simulation.notable import COLLIDED, NEARLY
from coverdrive.simulation.outcome import Cause, Fault
from coverdrive.simulation.statistics import miss_rate, misses_by_manoeuvre

_CAUSES = {cause: cause.value for cause in (Cause.PLANNING, Cause.PREDICTION)}
_FAULTS = {Fault.EGO: "ego", Fault.OTHER: "other vehicle", Fault.NONE: "nobody"}


class Tile(NamedTuple):
    """One number."""

    value: str
    label: str
    note: str
    main: bool = False
    """whether it is one of those that everyone looks at first"""


def heading(contents: Contents) -> str:
    """What was run, in a few words."""
    names = [recording["name"] for recording in contents.run["recordings"]]
    generated = all(re.fullmatch(r"generated \d+", name) for name in names)
    learned = "generated traffic" if generated else names[0] if len(names) == 1 else f"{len(names)} recordings"
    trials = "" if contents.trials is None else f", {contents.trials.height} closed-loop trials"
    return f"coverdrive on {learned}{trials}"


def verdict(contents: Contents) -> str:
    """What came out, in one sentence."""
    certificate, observed = contents.certified.driven[0], _observed(contents)
    missed = (
        f"of {whose(certificate)} {_bounded(certificate)} missed by their predicted sets "
        f"({strength(certificate)}), and {percent(observed.value)} were on unseen scenes"
    )
    if contents.trials is None:
        return f"{missed[0].upper()}{missed[1:]}."
    if contents.driven is None:
        return f"None of {contents.trials.height} drives could start; {missed}."
    collided = _collided(contents.driven)
    return (
        f"{collided.count or 'None'} of {collided.total} drives ended in a collision, at "
        f"{_mean(contents.driven, 'mean_speed'):.1f} m/s on average; {missed}."
    )


def shown_certificates(contents: Contents) -> list[Certificate]:
    """Of the sets that are planned against, and of the calibrated ones if those are others."""
    driven = contents.certified.driven[0]
    return [*([] if driven.scale == 1 else [driven]), *contents.certified.certificates]


def tiles(contents: Contents) -> list[Tile]:
    """The numbers that count."""
    certificate, observed, trials = contents.certified.driven[0], _observed(contents), contents.driven
    certified = Tile(
        f"≤ {at_most(certificate.epsilon, 3)}",
        f"of {whose(certificate)} missed, {strength(certificate)}"
        + ("" if certificate.scale == 1 else f"; sets of scale {certificate.scale:.2g}"),
        f"observed on unseen scenes: {percent(observed.value)} ({observed.counts}; 95 %: "
        f"{interval(observed.low, observed.high)})",
        main=True,
    )
    if trials is None:
        evaluation = contents.certified.driven[1]
        return [
            certified,
            Tile(
                evaluation.sized,
                "occupied" if evaluation.mean_area else "possible manoeuvres",
                "mean size of the predicted set",
            ),
        ]
    collided, missed = _collided(trials), miss_rate(trials, "shares_missed", "vehicles_seen")
    unsafe, rear = (percent(plan_share(trials, status)) for status in (Status.UNSAFE, Status.REAR))
    braking = float(trials["hardest_braking"].to_numpy().max())
    return [
        Tile(f"{collided.count} of {collided.total}", "drives with a collision",
             f"95 %: {interval(collided.low, collided.high)}", main=True),
        certified,
        Tile(f"{_mean(trials, 'mean_speed'):.1f} m/s", "mean speed", "of the ego over all drives"),
        Tile(f"{_mean(trials, 'jerk_longitudinal'):.1f} m/s³", "jerk along the road",
             f"root mean square, mean of the drives; hardest braking {braking:.1f} m/s²"),
        Tile(percent(plan_share(trials, Status.SOLVED, Status.FALLBACK)), "plans clear of all predicted paths",
             f"unsafe: {unsafe}; rear: {rear}"),
        Tile(percent(missed.value), "of a vehicle's windows missed in the drives",
             f"95 %: {interval(missed.low, missed.high)}; not certified for this traffic"),
    ]  # fmt: skip


def _collided(trials: pl.DataFrame) -> Rate:
    return Rate.of(trials.select(COLLIDED).to_series().to_numpy())


def _mean(trials: pl.DataFrame, column: str) -> float:
    return float(trials[column].to_numpy().mean())


def _observed(contents: Contents) -> Rate:
    """How many were missed on unseen scenes, of what the certificate counts."""
    certificate, evaluation = contents.certified.driven
    return evaluation.missed(certificate.unit)


def _bounded(certificate: Certificate) -> str:
    return "any share may be" if certificate.epsilon >= 1 else f"at most {at_most(certificate.epsilon, 3)} are"


def ends(contents: Contents) -> str:
    """How many drives ended in a collision, and why, in sentences; nothing without a study."""
    if contents.trials is None:
        return ""
    trials, idle = contents.driven, contents.trials.height
    if trials is None:
        return f"None of the {idle} trials could start: their vehicles found no room on the road."
    idle -= trials.height
    near, unsafe = trials.filter(NEARLY).height, percent(plan_share(trials, Status.UNSAFE))
    said = f" {idle} more could not start: their vehicles found no room on the road." if idle else ""
    return (
        f"{_collisions(trials)} {near} {'was a near miss' if near == 1 else 'were near misses'}. {unsafe} of all plans "
        f"were unsafe: nothing clear of the predicted paths was found.{said}"
    )


def _collisions(trials: pl.DataFrame) -> str:
    collided = trials.filter(COLLIDED)
    if collided.height == 0:
        return f"None of {trials.height} drives ended in a collision."
    causes, faults = (
        ", ".join(f"{name}: {(collided[column] == each.value).sum()}" for each, name in names.items())
        for column, names in (("cause", _CAUSES), ("at_fault", _FAULTS))
    )
    return f"{collided.height} of {trials.height} drives ended in a collision ({causes}). At fault: {faults}."


def plan_share(trials: pl.DataFrame, *statuses: Status) -> float:
    """Share of the plans of all drives that were found in one of these ways."""
    shares = sum(trials[f"share_{status.name.lower()}"].to_numpy() for status in statuses)
    return float(np.average(shares, weights=trials["time"].to_numpy()))


def facts(contents: Contents) -> list[tuple[str, str]]:
    """What was learned from what, line by line."""
    certified, basis, run = contents.certified, contents.predictor.basis, contents.run
    evaluation, samples = certified.evaluation, certified.samples
    recordings = run["recordings"]
    rows = sum(recording["rows"] for recording in recordings)
    median = None if contents.driven is None else 1e3 * float(np.median(contents.driven["planning_median"].to_numpy()))
    return [
        ("recordings", f"{len(recordings)} with {rows} rows in all"),
        ("segments", f"{samples['segments']} of {contents.predictor.horizon:g} s: {samples['train']} to train, "
         f"{samples['calibration']} to calibrate, {samples['test']} to test; {samples['dropped']} left out"),
        *([("base trajectories", f"{len(basis)} (ε = {basis.radius:g}; all training segments are covered)")]
          if basis is not None else []),
        *set_facts(basis, evaluation, certified.occupied, certified.uncovered),
        *([("prediction and plan", f"{median:.3g} ms (median step of the median trial); due every "
            f"{1e3 * contents.period:g} ms")] if median is not None else []),
        *([] if contents.driven is None else
          [(f"missed in drives: {name}", str(rate)) for name, rate in misses_by_manoeuvre(contents.driven).items()]),
        *([("drives", contents.road)] if contents.road else []),
        ("time", ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in run["seconds"].items())),
        ("software", f"coverdrive {run['coverdrive']}, Python {run['python']}, "
         + ", ".join(f"{name} {version}" for name, version in run["packages"].items())),
        ("seed", str(run["seed"])),
    ]  # fmt: skip
