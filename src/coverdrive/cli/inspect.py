"""``coverdrive inspect``: what is in recordings."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import AS_USUAL, Files, console, experiment_of
from coverdrive.errors import DataError


def inspect(
    *recording: Annotated[Path, Parameter(help="Files or folders of recordings, as in `scenarios/`.")],
    files: Files = AS_USUAL,
) -> dict[str, Any]:
    """Say what is in recordings: vehicles, minutes, lanes and where they are from, speeds, and what was repaired.

    For example:

    - a download of NGSIM: `coverdrive inspect us-101.csv --location us-101`
    - a folder of CommonRoad scenarios: `coverdrive inspect scenarios/`
    """
    if not recording:
        raise DataError("there is nothing to inspect; name a file or folder, as in `coverdrive inspect us-101.csv`")
    with waiting():
        from coverdrive.recordings.summary import summarise
        from coverdrive.reporting.terminal import recordings_table
    with stages():
        recordings = experiment_of(**vars(files)).recordings(recording)
    summaries = summarise(recordings)
    console.print(recordings_table(summaries))
    return {"recordings": [asdict(summary) for summary in summaries]}
