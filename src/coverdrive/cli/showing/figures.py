"""``coverdrive figures``: figures for a paper."""

from pathlib import Path
from typing import Any

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import Folder, Replayed, Studied, StudiedRoad, Trial, console


def figures(
    folder: Folder = Path("results"),
    *,
    trial: Trial = None,
    traffic: Studied = None,
    road: StudiedRoad = None,
    recording: Replayed = None,
) -> dict[str, Any]:
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
        files = draw_figures(results.fitted, results.driven_study(traffic, recording or [], road), trial)
    for file in files:
        console.print(str(file), soft_wrap=True)
    return {"figures": [str(file) for file in files]}
