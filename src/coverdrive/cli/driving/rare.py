"""``coverdrive rare``: how probable a collision is where no drive that one can afford has one."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.driving.study import AS_FITTED, Driven
from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console, processes


def rare(
    fit: options.Folder = Path("results"),
    *,
    driven: Driven = AS_FITTED,
    particles: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=2),
            help="Drives that each repetition goes on with, as in `--particles 400`.",
        ),
    ] = 200,
    repetitions: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=2),
            help="Independent repetitions, whose spread gives the standard error, as in `--repetitions 8`.",
        ),
    ] = 4,
    down_to: Annotated[
        float,
        Parameter(help="Probability below which no collision is looked for any more, as in `--down-to 1e-5`."),
    ] = 1e-6,
    out: Annotated[
        Path | None,
        Parameter(
            help="Folder of the estimate, as in `--out rare`.",
            show_default=lambda _: "`rare` in that of the fit, with the traffic and the road if they are others",
        ),
    ] = None,
    settings: options.Set = None,
    workers: options.Workers = None,
) -> dict[str, Any]:
    """Estimate how probable a collision is in a drive, down to one in a million, and keep the collisions found.

    Drives that come near a collision are copied, and what the traffic draws is changed a little, again and again
    (multilevel splitting). An estimate that was stopped goes on with the same command, and more repetitions join it.
    Replays of recorded scenes, which depend on each other, are refused.

    For example:

    - in the paper's traffic: `coverdrive rare results --road paper`
    - among few drivers: `coverdrive rare results --traffic drivers --vehicles 3 4 5 --repetitions 8`
    """
    with waiting():
        from coverdrive.dialling.rare import rare as estimate
        from coverdrive.results import RARE, STUDY, Results
        from coverdrive.simulation.studies.driven_on import driven_on
    results = Results(fit)
    experiment = driven.experiment(results, settings, workers=workers)
    study = driven.study(results, experiment)
    setup, folder = study.setup, out or results.folder / study.folder.name.replace(STUDY, RARE, 1)
    with stages(kept="finished repetitions"):
        found = estimate(
            setup, folder, particles=particles, rarest=down_to, repetitions=repetitions,
            workers=processes(experiment.study),
        )  # fmt: skip
    console.print(driven_on(setup))
    console.print(found.sentence)
    console.print(f"It took {found.drives:.0f} drives and {found.seconds:.0f} s of the processes together")
    kept = f"{len(found.collisions)}, in {folder / 'collisions'}" if found.collisions else "none was found"
    console.print(f"Drives with a collision: {kept}")
    return {
        "folder": str(folder),
        "level": found.level,
        "probability": found.probability,
        "standard_error": found.standard_error,
        "interval": found.interval,
        "drives": found.drives,
        "seconds": found.seconds,
        "collisions": [str(file) for file in found.collisions],
        "repetitions": found.repetitions,
    }
