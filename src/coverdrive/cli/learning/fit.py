"""``coverdrive fit``: a certified predictor."""

from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console, experiment_of
from coverdrive.locks import alone
from coverdrive.progress import stage

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit
    from coverdrive.recordings.recording import Recording
    from coverdrive.results import Results
    from coverdrive.simulation.roads.places import Place

_ROOM = 2**24
"""[bytes] that have to be free for a fit"""


@Parameter(name="*")
@dataclass(frozen=True)
class Learning:
    """What is learned from, with which claim and settings, and where it is kept."""

    recording: options.Recordings = None
    epsilon: options.Epsilon = None
    confidence: options.Confidence = None
    unit: options.Unit = None
    seed: options.Seed = None
    out: options.Out = Path("results")
    config: options.Config = None
    preset: options.Preset = "default"
    road: options.RoadName = None
    files: options.Files = options.AS_USUAL
    settings: options.Set = None

    def experiment(self, **parts: Any) -> "Experiment":
        """The settings, with further parts as `experiment_of` takes them."""
        claim = {"certificate": {"epsilon": self.epsilon, "confidence": self.confidence, "unit": self.unit}}
        return experiment_of(
            self.config, self.preset, self.settings, seed=self.seed, prediction=claim, **vars(self.files), **parts
        )

    @property
    def asked_road(self) -> str | None:
        """The name of the road that is asked for, if any is."""
        return self.road or ("paper" if self.preset == "paper" else None)


USUAL = Learning()


def fit(
    *,
    learning: Learning = USUAL,
    folds: Annotated[
        int | None,
        Parameter(
            converter=options.whole,
            validator=Number(gte=3, lte=20),
            help="Fit with every pair of so many parts of the scene groups as calibration and test side, print the "
            "spread, and keep no predictor; as in `--folds 4`, which is 12 fits.",
        ),
    ] = None,
) -> dict[str, Any]:
    """Learn a predictor from recordings, certify it, and test it on scenes that did not train it.

    For example:

    - from a download of NGSIM: `coverdrive fit --recording us-101.csv --location us-101`
    - another claim: `coverdrive fit --recording scenarios/ --epsilon 0.05 --unit window`
    - how much depends on which scenes calibrate: `coverdrive fit --recording scenarios/ --folds 4`
    - from generated traffic, as in the paper: `coverdrive fit --preset paper --out paper`
    """
    with waiting():
        from coverdrive.reporting.contents import Certified
        from coverdrive.results import Results, certificate_record

    if folds is not None:
        return _folds_and_print(learning, folds)
    result = fit_and_print(learning, Results(learning.out))
    console.print(f"The predictor is in {learning.out}")
    return {"results": str(learning.out), **certificate_record(Certified.of(result))}


def _folds_and_print(learning: Learning, folds: int) -> dict[str, Any]:
    """Fit with scene groups in every role, and say how far results spread."""
    with waiting():
        from coverdrive.prediction.fits.folds import fit_folds
        from coverdrive.reporting.tables.summaries import folds_table
    with stages():
        experiment, recordings, _ = _recorded(learning)
        found = fit_folds(recordings, experiment.prediction, experiment.seed, folds)
    console.print(folds_table(found))
    for refused in dict.fromkeys(each.refusal for each in found if each.refusal):
        console.print(f"• {refused}")
    return {"folds": [asdict(each) for each in found]}


def _recorded(learning: Learning, **parts: Any) -> "tuple[Experiment, Sequence[Recording], Place | None]":
    """The settings, and what is learned from: recordings, or traffic that is generated on the road of a name; and the
    place of that name, if one is given.
    """
    from coverdrive.simulation.roads.places import PLACES, place_of

    paths, named = learning.recording or [], PLACES.get(learning.road or "")
    if not paths:
        learning.files.settings_for(paths)
        place_of(learning.asked_road, None)  # refuses a recorded one before traffic is generated
    generated = None if paths else named and {**named.parts, "generated": named.road}
    experiment = learning.experiment(road=generated, **parts)
    return experiment, experiment.recordings(paths), named


def fit_and_print(learning: Learning, results: "Results", **parts: Any) -> "Fit":
    """Learn, certify, test, save, and say how it went; ``parts`` of the experiment are kept for what drives."""
    with waiting():
        from coverdrive.prediction.fit import fit
        from coverdrive.reporting.contents import Certified
        from coverdrive.reporting.tables.summaries import fit_table
        from coverdrive.simulation.measures.notable import recorded_near_misses
        from coverdrive.simulation.roads.places import place_of, recorded_place
    with stages():
        experiment, recordings, named = _recorded(learning, **parts)
        like = None
        if learning.recording:
            with stage("recorded place"):
                like = recorded_place(recordings)
        name, place = place_of(learning.asked_road, like)
        if like:
            manners = like.manners.model_dump(exclude={"like"}) if like.manners else {}
            usual = place.parts if name == "recorded" else {"planner": {"manners": manners}}
            experiment = learning.experiment(road=named and named.parts, usual=usual, **parts)
        with alone(results.folder):
            results.folder.mkdir(parents=True, exist_ok=True)
            try:
                with TemporaryFile(dir=results.folder) as file:
                    file.write(bytes(_ROOM))  # fails before hours of learning, if ever
                result = fit(recordings, experiment.prediction, experiment.seed)
            except BaseException:
                with suppress(OSError):
                    results.folder.rmdir()  # if nothing is in it
                raise
            with stage("recorded near misses") if like else nullcontext():
                near_misses = recorded_near_misses(recordings) if like else None
            results.save_fit(experiment, result, name, like, near_misses)
    console.print(fit_table(result))
    for each in Certified.of(result).proofs:
        console.print(f"• {each.sentence}")
    return result
