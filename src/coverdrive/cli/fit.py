"""``coverdrive fit``: a certified predictor."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import Config, Location, Out, Preset, Recordings, Seed, console, experiment_of

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit


def fit(
    *,
    recording: Recordings = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    preset: Preset = "default",
    location: Location = None,
) -> dict[str, Any]:
    """Learn a predictor from recordings, certify it, and test it on scenes that it never saw.

    For example:

    - from a download of NGSIM: `coverdrive fit --recording us-101.csv --location us-101`
    - from generated traffic, as in the paper: `coverdrive fit --preset paper --out paper`
    """
    from coverdrive.records import certificate_record

    result = fit_and_print(experiment_of(config, seed, location, preset=preset), recording or [], out)
    console.print(f"The predictor is in {out}")
    return {"results": str(out), **certificate_record(result)}


def fit_and_print(experiment: "Experiment", paths: Sequence[Path], out: Path) -> "Fit":
    """Learn, certify, test, and say how it went."""
    with waiting():
        from coverdrive import workflow
        from coverdrive.report.terminal import fit_table

    with stages() as bars:
        recordings = workflow.load_recordings(experiment, paths)
        result = workflow.fit_predictor(experiment, recordings, out, bars.report)
    console.print(fit_table(result))
    for certificate in result.certificates:
        console.print(f"• {certificate.sentence}")
    return result
