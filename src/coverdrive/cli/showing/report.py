"""``coverdrive report``: a results folder as one HTML page."""

from pathlib import Path
from typing import Any

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import Folder, Named, Replayed, Replays, Studied, StudiedRoad, console


def report(
    folder: Folder = Path("results"),
    *,
    trial: Named = None,
    replays: Replays = 8,
    traffic: Studied = None,
    road: StudiedRoad = None,
    recording: Replayed = None,
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
        path = write(
            results.fitted, results.driven_study(traffic, recording or [], road), trials=trial or [], replays=replays
        )
    console.print(f"The report is {path}", soft_wrap=True)
    return {"report": str(path)}
