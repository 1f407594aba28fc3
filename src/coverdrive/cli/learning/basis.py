"""``coverdrive basis``: the trajectory basis as a tool of its own."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import (
    AS_USUAL,
    Config,
    Files,
    Out,
    Seed,
    between,
    console,
    experiment_of,
    listed,
    usually,
)
from coverdrive.files import number_in_name, write_json, write_stream

if TYPE_CHECKING:
    from collections.abc import Sequence

    from coverdrive.config import Experiment
    from coverdrive.prediction.cover.basis_study import StudiedBasis


def basis(
    *recording: Annotated[
        Path, Parameter(help="Files or folders of recordings, as in `scenarios/`; without any, traffic is generated.")
    ],
    epsilon: Annotated[
        tuple[float, ...],
        Parameter(
            consume_multiple=True,
            validator=between(0, 1000),
            help="Radii of covers [m across the road], as in `--epsilon 0.5 1`.",
            show_default=listed,
        ),
    ] = (0.5, 0.75, 1.0, 2.0),
    stride: Annotated[
        float | None,
        Parameter(
            help="Time from one segment of a vehicle to the next [s], as in `--stride 0.5`.",
            show_default=usually("0.2"),
        ),
    ] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    files: Files = AS_USUAL,
) -> dict[str, Any]:
    """Cover all trajectory segments of recordings by few, for several ε, and bound how few could do.

    For example:

    - of generated traffic, to `results/bases/`: `coverdrive basis`
    - of recordings, with one ε: `coverdrive basis scenarios/ --epsilon 1 --out us101`
    """
    asked = {"seed": seed, "prediction": {"segments": {"stride": stride}}}
    experiment = experiment_of(config, **asked, **files.settings_for(recording))
    with waiting():
        from coverdrive.percentages import counted
        from coverdrive.prediction.cover.basis_study import basis_record, study_bases
        from coverdrive.prediction.data.segments import cut_segments
        from coverdrive.reporting.figures.gallery import draw_bases
        from coverdrive.reporting.tables.summaries import bases_table
    settings, folder = experiment.prediction, out / "bases"
    with stages():
        segments = cut_segments(experiment.recordings(recording), settings.segments)
        studied = study_bases(segments, epsilon, settings.basis, experiment.seed)
    save_bases(experiment, studied, folder)
    with waiting("drawing"):
        draw_bases(studied, segments, folder)
    console.print(f"{counted(len(segments), 'segment')} of {studied[0].basis.horizon:g} s")
    console.print(bases_table(studied))
    console.print(f"Bases and figures are in {folder}")
    return {"results": str(folder), "segments": len(segments), "bases": [basis_record(each) for each in studied]}


def save_bases(experiment: "Experiment", studied: "Sequence[StudiedBasis]", folder: Path) -> None:
    """Write every basis as safetensors and as a table of points, and what they were made with."""
    from coverdrive.prediction.cover.basis_study import basis_record, point_table
    from coverdrive.prediction.fits.provenance import versions

    experiment.save(folder / "config.toml")
    write_json(folder / "bases.json", versions() | {"bases": [basis_record(each) for each in studied]})
    for each in studied:
        name = f"basis_{number_in_name(each.basis.radius)}"
        each.basis.save(folder / f"{name}.safetensors", each.source)
        write_stream(folder / f"{name}.csv", point_table(each).write_csv)
