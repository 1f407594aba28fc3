"""``coverdrive basis``: the trajectory basis as a tool of its own."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import Config, Location, Out, Seed, console, experiment_of, usually


def basis(
    *recording: Annotated[Path, Parameter(help="Files or folders of recordings; without any, generated traffic.")],
    epsilon: Annotated[tuple[float, ...], Parameter(help="Radius of a cover.")] = (0.5, 0.75, 1.0, 2.0),
    stride: Annotated[
        float | None,
        Parameter(help="Time from one segment of a vehicle to the next [s].", show_default=usually("0.2")),
    ] = None,
    symmetric: Annotated[
        bool | None, Parameter(help="With every base trajectory its mirror image.", show_default=usually("no"))
    ] = None,
    centres: Annotated[
        Literal["segments", "free"] | None,
        Parameter(
            help="Base trajectories are segments, or any trajectories: fewer, with a longer search.",
            show_default=usually("segments"),
        ),
    ] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> dict[str, Any]:
    """Cover all trajectory segments of recordings by few, for several ε, and bound how few could do.

    For example:

    - of generated traffic: `coverdrive basis --out bases`
    - of recordings, with one ε: `coverdrive basis scenarios/ --epsilon 1 --symmetric --out bases`
    """
    experiment = experiment_of(config, seed, location).overridden(
        prediction={"segments": {"stride": stride}, "basis": {"symmetric": symmetric, "centres": centres}}
    )
    with waiting():
        from coverdrive import workflow
        from coverdrive.prediction.cover.basis_study import basis_record, study_bases
        from coverdrive.prediction.segments import cut_segments
        from coverdrive.progress import heard_by, stage
        from coverdrive.report.figures import draw_bases
        from coverdrive.report.terminal import bases_table
    settings = experiment.prediction
    with stages() as bars:
        recordings = workflow.load_recordings(experiment, recording, bars.share("recordings"))
        segments = cut_segments(recordings, settings.segments)
        with heard_by(bars.report), stage("bases"):
            studied = study_bases(segments, epsilon, settings.basis, experiment.seed)
    workflow.save_bases(experiment, recordings, studied, out)
    with waiting("drawing"):
        draw_bases(studied, segments, out / "figures")
    console.print(f"{len(segments)} segments of {studied[0].basis.horizon:g} s")
    console.print(bases_table(studied))
    console.print(f"Bases and figures are in {out}")
    return {"results": str(out), "segments": len(segments), "bases": [basis_record(each) for each in studied]}
