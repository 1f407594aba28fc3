"""The closed-loop study in sentences."""

import numpy as np
import polars as pl

from coverdrive.numbers import percent
from coverdrive.planning.plan import Status
from coverdrive.reporting.contents import Contents
from coverdrive.simulation.notable import COLLIDED, NEARLY
from coverdrive.simulation.outcome import Cause, Fault

_CAUSES = {cause: cause.value for cause in (Cause.PLANNING, Cause.PREDICTION)}
_FAULTS = {Fault.EGO: "ego", Fault.OTHER: "other vehicle", Fault.NONE: "nobody"}


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
    shares = sum(trials[f"share_{status.value}"].to_numpy() for status in statuses)
    return float(np.average(shares, weights=trials["time"].to_numpy()))
