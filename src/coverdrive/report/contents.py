"""Everything that a report can show; what a results folder does not hold yet is None or empty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.predictor import Predictor
from coverdrive.report.binding import Binding
from coverdrive.simulation.trace import Trace


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

    @staticmethod
    def of(fit: Fit) -> "Certified":
        """What a fit has certified."""
        split = fit.split
        samples = {"segments": len(fit.segments), "dropped": split.dropped}
        samples |= {side: len(getattr(split, side)) for side in ("train", "calibration", "test")}
        return Certified(fit.certificates, fit.evaluation, fit.uncovered, samples)


@dataclass(frozen=True)
class Contents:
    """One results folder."""

    name: str
    """of the folder"""
    run: Mapping[str, Any]
    """versions, data and times"""
    settings: str
    """all settings, as TOML"""
    predictor: Predictor
    certified: Certified
    learned: Learned
    compared: Sequence[Compared]
    """all methods of calibration; empty before ``coverdrive certify``"""
    trials: pl.DataFrame | None
    """one row for each trial; none before ``coverdrive study``"""
    traffic: str
    """in which the trials were driven"""
    period: float
    """[s] between two plans"""
    binding: Binding | None
    """tells which obstacles bind a plan"""
    traces: Mapping[int, Trace]
    """drives to replay, by the number of their trial"""
