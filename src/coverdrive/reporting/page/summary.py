"""The page in words: the numbers that count, how the drives of the study ended, and where everything comes from."""

from typing import NamedTuple

import numpy as np
import polars as pl

from coverdrive.certificates.evaluation import Rate
from coverdrive.dialling.dial import Dialled
from coverdrive.percentages import at_most, interval, percent
from coverdrive.reporting.claim import set_facts, strength, whose
from coverdrive.reporting.contents import Contents
from coverdrive.simulation.drivers.generated import is_generated
from coverdrive.simulation.drives.outcome import Cause, Fault
from coverdrive.simulation.measures.notable import COLLIDED, NEAR_GAP, NEAR_TIME, NEARLY
from coverdrive.simulation.measures.statistics import (
    DEPENDENT,
    braking_behind,
    median_headway,
    miss_rate,
    misses_by_manoeuvre,
    plan_share,
)

_BEST = "known-future"
"""the entrant of the league whose speed no prediction beats"""

_CAUSES = {cause: cause.value for cause in (Cause.PLANNING, Cause.PREDICTION, Cause.START)}
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
    learned = names[0] if len(names) == 1 else f"{len(names)} recordings"
    learned = "generated traffic" if _generated(contents) else learned
    trials = "" if contents.trials is None else f", {contents.trials.height} closed-loop trials"
    return f"coverdrive on {learned}{trials}"


def _generated(contents: Contents) -> bool:
    """Whether it was learned from generated traffic."""
    return all(is_generated(recording["name"]) for recording in contents.run["recordings"])


def verdict(contents: Contents) -> str:
    """What is proved, in one sentence: of such drives by the dial, else by those of the study, else of the sets."""
    dialled = contents.dialled
    if dialled is not None and not contents.unlike:
        return f"{dialled.proofs[0].sentence}; {dialled.mean_speed:.1f} m/s{_of_the_best(dialled)}."
    if contents.driven is not None:
        return f"{contents.proved}; {_mean(contents.driven, 'mean_speed'):.1f} m/s on average."
    certificate, observed = contents.certified.driven[0], _observed(contents)
    bounded = "any share may be" if certificate.epsilon >= 1 else f"at most {at_most(certificate.epsilon, 3)} are"
    missed = (
        f"of {whose(certificate)} {bounded} missed by their predicted sets "
        f"({strength(certificate)}), and {percent(observed.value)} were on scenes that did not train the predictor."
    )
    if contents.trials is None:
        return f"{missed[0].upper()}{missed[1:]}"
    return f"None of {contents.trials.height} drives could start; {missed}"


def _of_the_best(dialled: Dialled) -> str:
    """The speed of the dial as a share of that with the future known, if that was driven beside."""
    known = dialled.frontier.filter(pl.col("who") == _BEST)
    if known.is_empty():
        return ""
    share = dialled.mean_speed / float(known["mean_speed"].to_numpy().max())
    return f", {percent(share, 2)} of knowing the future"


def exposure(trials: pl.DataFrame) -> str:
    """How long and how far drives went."""
    seconds, way = (float(trials[name].to_numpy().sum()) for name in ("time", "distance"))
    unit, name = (3600, "h") if seconds >= 3600 else (60, "min") if seconds >= 60 else (1, "s")
    return f"{seconds / unit:.1f} {name}, {way / 1000:.3g} km"


def tiles(contents: Contents) -> list[Tile]:
    """The numbers that count."""
    certificate, observed, trials = contents.certified.driven[0], _observed(contents), contents.driven
    ends = interval(observed.low, observed.high)
    seen = f"{percent(observed.value)} on scenes that did not train the predictor (95 %: {ends})"
    scale, bound = f"sets of scale {certificate.scale:.2g}", f"≤ {at_most(certificate.epsilon, 3)}"
    if trials is None:
        evaluation = contents.certified.driven[1]
        note = seen if certificate.scale == 1 else f"{scale}; {seen}"
        return [
            Tile(bound, f"of {whose(certificate)} missed, {strength(certificate)}", note),
            Tile(
                evaluation.sized,
                "occupied" if evaluation.mean_area else "possible manoeuvres",
                "mean size of the predicted set",
            ),
        ]
    near, usual = trials.filter(NEARLY).height, median_headway(trials)
    gap, time = _least(trials, "minimum_gap", "m"), _least(trials, "minimum_time_to_collision", "s")
    plans = round(float(trials["time"].to_numpy().sum()) / contents.period)
    missed, counted = _missed_in_drives(contents, trials)
    here = DEPENDENT if contents.replayed else f"95 %: {interval(missed.low, missed.high)}"
    braking = f"hardest braking {float(trials['hardest_braking'].to_numpy().max()):.1f} m/s²"
    behind = None if contents.replayed else braking_behind(trials)  # who is replayed does not brake for the ego
    if behind is not None:
        braking += f"; of those behind up to {behind[0]:.1f} in half of the drives, at least {behind[1]:.1f} in 1 of 20"
    like_these = contents.replayed and not _generated(contents)
    taught = "that which taught them" if like_these else "that which taught them, not this"
    return [
        Tile(f"{near} of {trials.height}",
             f"drives of this study are near misses: nearer than {NEAR_GAP:g} m, or {NEAR_TIME:g} s from a collision",
             f"least gap {gap}, least time to collision {time}; {exposure(trials)}{_recorded_near(contents)}",
             main=True),
        Tile(f"{usual:.2f} s" if np.isfinite(usual) else "–", "of headway, kept in 9 of 10 moments of the median drive",
             _recorded_headway(contents)),
        Tile(f"{_mean(trials, 'jerk_longitudinal'):.1f} m/s³", "jerk along the road, root mean square", braking),
        Tile(percent(plan_share(trials, "solved", "fallback")),
             f"of {plans:,} plans clear of all predicted paths",
             f"{percent(plan_share(trials, 'unsafe'))} unsafe; clear plans lost: {int(trials['lost_clear'].sum())}"),
        Tile(percent(missed.value) if missed.total else "–",
             f"of {counted} left their sets here: less is better ({here})",
             f"{scale}; certified in traffic like {taught}: {bound} {strength(certificate)}; there {seen}"),
    ]  # fmt: skip


def _recorded_near(contents: Contents) -> str:
    """How many recorded vehicles came as near, if any were recorded."""
    near = contents.run.get("recorded_near_misses")
    return (
        f"; {percent(near['share'], 2)} of recorded vehicles came as near in {near['seconds']:.0f} s each"
        if near
        else ""
    )


def _recorded_headway(contents: Contents) -> str:
    """What headway recorded drivers keep, if any were recorded."""
    manners = (contents.run.get("recorded_place") or {}).get("manners")
    return f"recorded drivers: {manners['headway']:.2f} s" if manners else ""


def _least(trials: pl.DataFrame, column: str, unit: str) -> str:
    value = float(trials[column].to_numpy().min())
    return f"{value:.2f} {unit}" if np.isfinite(value) else "–"


def _missed_in_drives(contents: Contents, trials: pl.DataFrame) -> tuple[Rate, str]:
    """How many were missed in the drives, of what a certificate counts, and of what that is a share."""
    columns = {"window": ("prediction_misses", "windows"), "share": ("shares_missed", "vehicles_seen")}
    unit = contents.certified.driven[0].unit
    missed = miss_rate(trials, *columns.get(unit, ("vehicles_missed", "vehicles_seen")), contents.replayed)
    return missed, f"what others do in {contents.predictor.horizon:g} s" if unit in columns else "the others"


def _mean(trials: pl.DataFrame, column: str) -> float:
    return float(trials[column].to_numpy().mean())


def _observed(contents: Contents) -> Rate:
    """How many were missed on scenes that did not train, of what the certificate counts."""
    certificate, evaluation = contents.certified.driven
    return evaluation.missed(certificate.unit)


def ends(contents: Contents) -> str:
    """How many drives ended in a collision, and why, in sentences; nothing without a study."""
    if contents.trials is None:
        return ""
    trials, idle = contents.driven, contents.trials.height
    if trials is None:
        return f"None of the {idle} trials could start: their vehicles found no room on the road."
    idle -= trials.height
    near, unsafe = trials.filter(NEARLY).height, percent(plan_share(trials, "unsafe"))
    said = f" {idle} more could not start: their vehicles found no room on the road." if idle else ""
    return (
        f"{_collisions(trials)} {near} {'was a near miss' if near == 1 else 'were near misses'}. {unsafe} of all plans "
        f"were unsafe (nothing clear of the predicted paths was found).{said}"
    )


def _collisions(trials: pl.DataFrame) -> str:
    collided = trials.filter(COLLIDED)
    if collided.height == 0:
        return f"None of {trials.height} drives ({exposure(trials)}) ended in a collision."
    causes, faults = (
        ", ".join(f"{name}: {(collided[column] == each.value).sum()}" for each, name in names.items())
        for column, names in (("cause", _CAUSES), ("at_fault", _FAULTS))
    )
    return (
        f"{collided.height} of {trials.height} drives ({exposure(trials)}) ended in a collision ({causes}). At fault: "
        f"{faults}."
    )


def facts(contents: Contents) -> list[tuple[str, str]]:
    """What was learned from what, line by line."""
    certified, basis, run = contents.certified, contents.predictor.basis, contents.run
    evaluation, samples = certified.evaluation, certified.samples
    recordings = run["recordings"]
    rows = sum(recording["rows"] for recording in recordings)
    median = None if contents.driven is None else 1e3 * float(np.median(contents.driven["planning_median"].to_numpy()))
    return [
        ("recordings", f"{len(recordings)} with {rows:,} rows in all"),
        ("segments", f"{samples['segments']:,} of {contents.predictor.horizon:g} s: {samples['train']:,} to train, "
         f"{samples['calibration']:,} to calibrate, {samples['test']:,} to test; {samples['dropped']:,} left out"),
        *([("base trajectories", f"{len(basis)} (ε = {basis.radius:g}; all training segments are covered)")]
          if basis is not None else []),
        *set_facts(basis, evaluation, certified.occupied, certified.uncovered, certified.certificates[0].unit),
        *([("prediction and plan", f"{median:.3g} ms (median step of the median trial); due every "
            f"{1e3 * contents.period:g} ms")] if median is not None else []),
        *([] if contents.driven is None else
          [(f"missed in drives: {name}", str(rate))
           for name, rate in misses_by_manoeuvre(contents.driven, contents.replayed).items()]),
        *([("drives", contents.road)] if contents.road else []),
        ("time", ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in run["seconds"].items())),
        ("software", f"coverdrive {run['coverdrive']}, Python {run['python']}, "
         + ", ".join(f"{name} {version}" for name, version in run["packages"].items())),
        ("seed", str(run["seed"])),
    ]  # fmt: skip
