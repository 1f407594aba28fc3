"""``coverdrive report``, ``figures`` and ``animate``: what was found before, on a page, in a paper, as a video."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import Folder, Roads, Traffics, console, whole

if TYPE_CHECKING:
    from coverdrive.results import Results
    from coverdrive.simulation.studies.study import Study


@Parameter(name="*")
@dataclass(frozen=True)
class Shown:
    """Which study of a results folder is shown."""

    traffic: Annotated[
        Traffics | None,
        Parameter(
            help="Traffic of the study to show, as in `--traffic drivers`; else that of the results folder's settings, "
            "or of the only study there is."
        ),
    ] = None
    road: Annotated[
        Roads | None,
        Parameter(help="Road of the study to show, as in `--road curved`; else that of the results folder."),
    ] = None
    recording: Annotated[
        list[Path] | None,
        Parameter(
            consume_multiple=True,
            help="Recordings that the study replayed, as in `--recording scenarios/`; needed if drives in replayed "
            "traffic are not stored yet.",
        ),
    ] = None

    def study(self, results: "Results") -> "Study":
        """The study, as it was driven."""
        return results.driven_study(self.traffic, self.recording or [], self.road)


AS_DRIVEN = Shown()
_Number = Number(gte=0, lte=9_999_999)
Trial = Annotated[
    int | None,
    Parameter(
        converter=whole,
        validator=_Number,
        help="Number of the trial, from 0, as in `--trial 7`; else the drive in which most happens.",
    ),
]


def report(
    folder: Folder = Path("results"),
    *,
    trial: Annotated[
        list[Annotated[int, Parameter(converter=whole, validator=_Number)]] | None,
        Parameter(
            consume_multiple=True,
            help="Trials to replay besides collisions, near misses and the liveliest, by their numbers from 0; as in "
            "`--trial 7 12`.",
        ),
    ] = None,
    replays: Annotated[
        int,
        Parameter(
            converter=whole,
            validator=Number(gte=0, lte=1000),
            help="Number of drives to replay at most, as in `--replays 3`: collisions, near misses, the liveliest.",
        ),
    ] = 8,
    shown: Shown = AS_DRIVEN,
) -> dict[str, Any]:
    """Show everything in a results folder on one HTML page that needs no network, with drives to replay.

    Drives that are to be replayed are driven again from their seeds, and kept in the folder.

    For example:

    - write `results/report.html` again: `coverdrive report`
    - with the replays of certain drives: `coverdrive report us101 --trial 7 12`
    """
    with waiting():
        from coverdrive.reporting.report import report as write
        from coverdrive.results import Results
    results = Results(folder)
    with stages():
        path = write(results.fitted, shown.study(results), trials=trial or [], replays=replays)
    console.print(f"The report is {path}", soft_wrap=True)
    return {"report": str(path)}


def figures(folder: Folder = Path("results"), *, trial: Trial = None, shown: Shown = AS_DRIVEN) -> dict[str, Any]:
    """Draw all figures of a results folder, as PDF (vectors) and PNG.

    For example:

    - those of `results/`: `coverdrive figures`
    - with snapshots of a certain drive: `coverdrive figures us101 --trial 7`
    """
    with waiting():
        from coverdrive.reporting.report import draw_figures
        from coverdrive.results import Results
    results = Results(folder)
    with stages():
        files = draw_figures(results.fitted, shown.study(results), trial)
    for file in files:
        console.print(str(file), soft_wrap=True)
    return {"figures": [str(file) for file in files]}


def animate(
    folder: Folder = Path("results"),
    *,
    trial: Trial = None,
    format: Annotated[
        Literal["mp4", "gif"],
        Parameter(help="MP4 for players, GIF for slides and web pages; as in `--format gif`."),
    ] = "mp4",
    shown: Shown = AS_DRIVEN,
) -> dict[str, Any]:
    """Write one drive of a results folder as a video that plays in real time.

    For example:

    - the drive of `results/` in which most happens: `coverdrive animate`
    - another one, for slides: `coverdrive animate us101 --trial 7 --format gif`
    """
    with waiting():
        from coverdrive.reporting.report import animate_drive
        from coverdrive.results import Results
    results = Results(folder)
    with stages():
        path = animate_drive(results.fitted, shown.study(results), trial, format)
    console.print(f"The video is {path}", soft_wrap=True)
    return {"video": str(path)}
