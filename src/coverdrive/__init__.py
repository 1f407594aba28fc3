"""Certified manoeuvre sets from recorded highway traffic, and motion planning against every member of them.

A dozen names are all that most work needs; each is loaded when it is first used:

    import coverdrive as cd

    recordings = cd.read("us-101.csv", location="us-101")       # or cd.generate()
    result = cd.fit(recordings, epsilon=0.1, confidence=0.99)   # learn, certify, test
    study = cd.study(result.predictor, trials=100, folder="study", recordings=recordings)  # on a road like theirs
    cd.report(result, study, path="report.html")

The sub-packages read from top to bottom as the data flow: ``recordings`` → ``prediction`` and ``certificates`` →
``planning`` → ``simulation`` → ``reporting``.

Source of the method: Chen, Rosolia, Fan, Ames, Murray, "Reactive motion planning with probabilistic safety
guarantees", CoRL 2020.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from coverdrive._version import __version__ as __version__

if TYPE_CHECKING:
    from coverdrive.certificates.certificate import Certificate as Certificate
    from coverdrive.certificates.comparison import Compared as Compared
    from coverdrive.dialling.dial import Dialled as Dialled
    from coverdrive.dialling.dial import dial as dial
    from coverdrive.driving.driver import Command as Command
    from coverdrive.driving.driver import Driver as Driver
    from coverdrive.driving.goal import Goal as Goal
    from coverdrive.driving.recorder import Recorder as Recorder
    from coverdrive.errors import CoverdriveError as CoverdriveError
    from coverdrive.paths import PredictedPaths as PredictedPaths
    from coverdrive.plan import Plan as Plan
    from coverdrive.planning.planner import MpcPlanner
    from coverdrive.prediction.adaptive import Adaptive as Adaptive
    from coverdrive.prediction.fit import Fit as Fit
    from coverdrive.prediction.fit import fit as fit
    from coverdrive.prediction.fits.calibrations import certify as certify
    from coverdrive.prediction.fits.folds import Fold as Fold
    from coverdrive.prediction.fits.folds import fit_folds as fit_folds
    from coverdrive.prediction.predictor import Predictor as Predictor
    from coverdrive.recordings.formats.registry import readers as readers
    from coverdrive.recordings.formats.registry import register_reader as register_reader
    from coverdrive.recordings.map_tracks import MapTracks as MapTracks
    from coverdrive.recordings.read import read as read
    from coverdrive.recordings.recording import Recording as Recording
    from coverdrive.reporting.report import report as report
    from coverdrive.road import Road as Road
    from coverdrive.scene import Scene as Scene
    from coverdrive.simulation.drivers.generated import generate as generate
    from coverdrive.simulation.drives.trace import Trace as Trace
    from coverdrive.simulation.studies.comparison import Comparison as Comparison
    from coverdrive.simulation.studies.comparison import compare as compare
    from coverdrive.simulation.studies.study import Study as Study
    from coverdrive.simulation.studies.study import simulate as simulate
    from coverdrive.simulation.studies.study import study as study

    Planner = MpcPlanner

_PLACES = {
    "read": "recordings.read",
    "readers": "recordings.formats.registry",
    "register_reader": "recordings.formats.registry",
    "MapTracks": "recordings.map_tracks",
    "generate": "simulation.drivers.generated",
    "fit": "prediction.fit",
    "fit_folds": "prediction.fits.folds",
    "certify": "prediction.fits.calibrations",
    "dial": "dialling.dial",
    "Predictor": "prediction.predictor",
    "Adaptive": "prediction.adaptive",
    "Planner": "planning.planner:MpcPlanner",
    "Driver": "driving.driver",
    "Command": "driving.driver",
    "Goal": "driving.goal",
    "Recorder": "driving.recorder",
    "simulate": "simulation.studies.study",
    "study": "simulation.studies.study",
    "compare": "simulation.studies.comparison",
    "report": "reporting.report",
    "Recording": "recordings.recording",
    "Scene": "scene",
    "Road": "road",
    "Fit": "prediction.fit",
    "Fold": "prediction.fits.folds",
    "Dialled": "dialling.dial",
    "Certificate": "certificates.certificate",
    "Compared": "certificates.comparison",
    "PredictedPaths": "paths",
    "Plan": "plan",
    "Trace": "simulation.drives.trace",
    "Study": "simulation.studies.study",
    "Comparison": "simulation.studies.comparison",
    "CoverdriveError": "errors",
}
"""module of every name, and its name there where that is another one"""

__all__ = list(_PLACES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Load a name of the façade."""
    if name not in _PLACES:
        raise AttributeError(f"module 'coverdrive' has no attribute {name!r}; it offers {', '.join(_PLACES)}")
    module, _, inner = _PLACES[name].partition(":")
    value = getattr(import_module(f"coverdrive.{module}"), inner or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_PLACES])
