"""Everything that a report can show; what there is not (yet) is None or empty, and its section says how to make it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.dialling.dial import Dialled
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.prediction.certifying.occupied import Occupied
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.fits.learned import Learned
from coverdrive.prediction.fits.provenance import provenance
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import STARTED


@dataclass(frozen=True)
class Certified:
    """What is proved about the predictor, and how it did on scenes that did not train it."""

    certificates: tuple[Certificate, ...]
    """of the calibrated sets, the one asked for first"""
    evaluation: Evaluation
    """of these"""
    driven: tuple[Certificate, Evaluation]
    """the same of the sets that are planned against"""
    occupied: Occupied
    """how large its sets are there, beside those of the trivial predictor"""
    uncovered: Rate
    """test windows that are outside of every set"""
    samples: Mapping[str, int]
    """windows on every side of the split"""

    @property
    def planned_against(self) -> tuple[Certificate, ...]:
        """The certificates of the sets that are planned against."""
        return self.certificates if self.driven[0].scale == 1 else (self.driven[0],)

    @property
    def proofs(self) -> tuple[Certificate, ...]:
        """All certificates: of the calibrated sets, and of those that are planned against if they are others."""
        return self.certificates if self.driven[0].scale == 1 else (*self.certificates, self.driven[0])

    @staticmethod
    def of(fit: Fit) -> "Certified":
        """What a fit has certified."""
        split = fit.split
        samples = {"segments": len(fit.segments), "dropped": split.dropped}
        samples |= {side: len(getattr(split, side)) for side in ("train", "calibration", "test")}
        driven = fit.predictor.certificate, fit.driven
        return Certified(fit.certificates, fit.evaluation, driven, fit.occupied, fit.uncovered, samples)


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
    predictor: AnyPredictor
    certified: Certified
    learned: Learned
    compared: Sequence[Compared] = ()
    """all methods of calibration; empty before ``coverdrive calibrations``"""
    dialled: Dialled | None = None
    """what drives were proved to risk with these sets; none before ``coverdrive dial``"""
    league: pl.DataFrame | None = None
    """the table of `coverdrive.league.table`; none before ``coverdrive league``"""

    @staticmethod
    def of(fit: Fit) -> "Fitted":
        """A fit that is in no folder."""
        settings, learned = fit.settings.model_dump_json(indent=2), Learned.of(fit)
        return Fitted("coverdrive", Path(), provenance(fit), settings, fit.predictor, Certified.of(fit), learned)


@dataclass(frozen=True)
class Contents(Fitted):
    """A fit, and a study that was driven with its predictor."""

    trials: pl.DataFrame | None = None
    """one row for each trial; none before ``coverdrive study``"""
    traffic: str = ""
    """in which the trials were driven"""
    proved: str = ""
    """what they prove of others like them, in a sentence; nothing if none could start"""
    replayed: bool = False
    """whether that replays scenes, of which several drives may be alike"""
    unlike: str = ""
    """in what the trials are other drives than those that the dial proved; nothing if it proved such drives, or none"""
    road: str = ""
    """on which they were driven, in a sentence"""
    period: float = 0.1
    """[s] between two plans"""
    problem: ProblemSettings | None = None
    """that the planner solves, which tells what is active in a plan; none if the planner is not ours"""
    traces: Mapping[int, Trace] = field(default_factory=dict[int, Trace])
    """drives to replay, by the number of their trial"""

    @property
    def driven(self) -> pl.DataFrame | None:
        """The trials that could start; none if there is no study, or none of its trials could."""
        started = None if self.trials is None else self.trials.filter(STARTED)
        return None if started is None or started.is_empty() else started
