"""``coverdrive inspect``: what is in recordings, in a table and in pictures."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import AS_USUAL, Files, console, experiment_of
from coverdrive.errors import DataError
from coverdrive.progress import done, stage

if TYPE_CHECKING:
    from coverdrive.recordings.recording import Recording


def inspect(
    *recording: Annotated[Path, Parameter(help="Files or folders of recordings, as in `scenarios/`.")],
    files: Files = AS_USUAL,
    plot: Annotated[
        Path | None, Parameter(help="Name of pictures of each road, its lanes and tracks, as in `--plot road`.")
    ] = None,
    histogram: Annotated[
        Path | None, Parameter(help="Name of a picture of speeds, gaps and accelerations, as in `--histogram speeds`.")
    ] = None,
) -> dict[str, Any]:
    """Say what is in recordings: vehicles, minutes, lanes and where they are from, speeds, and what was repaired.

    For example:

    - a download of NGSIM: `coverdrive inspect us-101.csv --location us-101`
    - a folder of CommonRoad scenarios: `coverdrive inspect scenarios/`
    - with pictures: `coverdrive inspect us-101.csv --plot road --histogram speeds`
    """
    if not recording:
        raise DataError("there is nothing to inspect; name a file or folder, as in `coverdrive inspect us-101.csv`")
    with waiting():
        from coverdrive.recordings.summary import summarise
        from coverdrive.reporting.tables.summaries import recordings_table
    with stages():
        recordings = experiment_of(**vars(files)).recordings(recording)
    summaries = summarise(recordings)
    console.print(recordings_table(summaries))
    drawn = _draw(recordings, plot, histogram)
    for file in drawn:
        console.print(str(file), soft_wrap=True)
    return {"recordings": [asdict(summary) for summary in summaries], "figures": [str(file) for file in drawn]}


def _draw(recordings: Sequence["Recording"], plot: Path | None, histogram: Path | None) -> list[Path]:
    """Draw what is asked for, as PNG and PDF; the pictures of several recordings are numbered from 1."""
    if plot is None and histogram is None:
        return []
    with waiting():
        from coverdrive.reporting.figures.recording import histogram_figure, road_figure
        from coverdrive.reporting.plotting.drawing import save
    files: list[Path] = []
    with stages(), stage("drawing"):
        if plot is not None:
            for number, recording in enumerate(recordings, start=1):
                name = _stem(plot).name + (f"-{number}" if len(recordings) > 1 else "")
                files += save(road_figure(recording), plot.with_name(name))
                done(number, len(recordings))
        if histogram is not None:
            files += save(histogram_figure(recordings), _stem(histogram))
    return files


def _stem(path: Path) -> Path:
    """A name of pictures without the ending that they get."""
    return path.with_suffix("") if path.suffix.lower() in (".png", ".pdf") else path
