"""``coverdrive fit``: a certified predictor."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coverdrive.cli import options
from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import certificate, console, experiment_of

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit
    from coverdrive.results import Results


def fit(
    *,
    recording: options.Recordings = None,
    epsilon: options.Epsilon = None,
    confidence: options.Confidence = None,
    unit: options.Unit = None,
    seed: options.Seed = None,
    out: options.Out = Path("results"),
    config: options.Config = None,
    preset: options.Preset = "default",
    location: options.Location = None,
    settings: options.Set = None,
) -> dict[str, Any]:
    """Learn a predictor from recordings, certify it, and test it on scenes that it never saw.

    For example:

    - from a download of NGSIM: `coverdrive fit --recording us-101.csv --location us-101`
    - the smallest bound that the data can prove: `coverdrive fit --recording scenarios/ --epsilon auto`
    - from generated traffic, as in the paper: `coverdrive fit --preset paper --out paper`
    """
    with waiting():
        from coverdrive.results import Results, certificate_record
    experiment = experiment_of(
        config, preset, settings, seed=seed, location=location, prediction=certificate(epsilon, confidence, unit)
    )
    result = fit_and_print(experiment, recording or [], Results(out))
    console.print(f"The predictor is in {out}")
    return {"results": str(out), **certificate_record(result)}


def fit_and_print(experiment: "Experiment", paths: Sequence[Path], results: "Results") -> "Fit":
    """Learn, certify, test, save, and say how it went."""
    with waiting():
        from coverdrive.prediction.fit import fit
        from coverdrive.reporting.terminal import fit_table
    with stages():
        result = fit(experiment.recordings(paths), experiment.prediction, experiment.seed)
        results.save_fit(experiment, result)
    console.print(fit_table(result))
    for each in result.certificates:
        console.print(f"• {each.sentence}")
    return result
