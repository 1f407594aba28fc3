"""Everything that a report can show; what there is not (yet) is None or empty, and its section says how to make it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.predictor import Predictor
from coverdrive.report.active_constraints import ActiveConstraints
from coverdrive.simulation.trace import Trace

NOT_STARTED = "not started"
"""kind of a trial whose vehicles could not be placed"""


@dataclass(frozen=True)
class Certified:
    """What is proved about the predictor, and how it did on scenes that it never saw."""

    certificates: tuple[Certificate, ...]
    """that of the predictor first"""
    evaluation: Evaluation
    uncovered: Rate
    """test windows that no base covers"""
    samples: Mapping[str, int]
    """windows on every side of the split"""


@dataclass(frozen=True, kw_only=True)
class Contents:
    """A fit, and the studies and drives that were made with it."""

    name: str
    """of the whole, as a results folder has one"""
    run: Mapping[str, Any]
    """versions, data and times"""
    settings: str
    """all settings, as TOML"""
    predictor: Predictor
    certified: Certified
    learned: Learned
    compared: Sequence[Compared] = ()
    """all methods of calibration; empty before ``coverdrive certify``"""
    trials: pl.DataFrame | None = None
    """one row for each trial; none before ``coverdrive study``"""
    traffic: str = ""
    """in which the trials were driven"""
    period: float = 0.1
    """[s] between two plans"""
    constraints: ActiveConstraints | None = None
    """tells which are active in a plan; none are marked if it is left out"""
    traces: Mapping[int, Trace] = field(default_factory=dict[int, Trace])
    """drives to replay, by the number of their trial"""

    @property
    def driven(self) -> pl.DataFrame | None:
        """The trials that could start; none if there is no study, or none of its trials could."""
        if self.trials is None:
            return None
        started = self.trials.filter(pl.col("kind") != NOT_STARTED)
        return None if started.is_empty() else started
