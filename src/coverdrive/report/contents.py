"""Everything that a report can show; what a results folder does not hold yet is None or empty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.provenance import provenance
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
class Fitted:
    """What a fit has left."""

    name: str
    """of the results folder"""
    folder: Path
    """of results; that of the process if they are in none"""
    run: Mapping[str, Any]
    """versions, data and times"""
    settings: str
    """all settings, as TOML or JSON"""
    predictor: Predictor
    certified: Certified
    learned: Learned
    compared: Sequence[Compared] = ()
    """all methods of calibration; empty before ``coverdrive certify``"""

    @staticmethod
    def of(fit: Fit) -> "Fitted":
        """A fit that is in no folder."""
        settings = fit.settings.model_dump_json(indent=2)
        return Fitted(
            "coverdrive", Path(), provenance(fit), settings, fit.predictor, Certified.of(fit), Learned.of(fit)
        )


@dataclass(frozen=True)
class Contents(Fitted):
    """A fit, and a study that was driven with its predictor."""

    trials: pl.DataFrame | None = None
    """one row for each trial; none before ``coverdrive study``"""
    traffic: str = ""
    """in which the trials were driven"""
    period: float = 0.1
    """[s] between two plans"""
    binding: Binding | None = None
    """tells which obstacles bind a plan"""
    traces: Mapping[int, Trace] = field(default_factory=dict)
    """drives to replay, by the number of their trial"""
