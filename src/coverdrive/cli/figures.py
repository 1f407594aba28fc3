"""``coverdrive figures``: figures for a paper."""

from pathlib import Path
from typing import Any

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import Folder, Replayed, Studied, Trial, clips_reader, console, shown_study


def figures(
    folder: Folder = Path("results"), *, trial: Trial = None, traffic: Studied = None, recording: Replayed = None
) -> dict[str, Any]:
    """Draw all figures of a results folder, as PDF (vectors) and PNG.

    For example:

    - those of `results/`: `coverdrive figures`
    - with snapshots of a certain drive: `coverdrive figures us101 --trial 7`
    """
    with waiting():
        from coverdrive.pictures import draw_figures
    study = shown_study(folder, traffic)
    with stages() as bars:
        clips = clips_reader(folder, study, recording, bars.share("recordings"))
        files = draw_figures(folder, bars.report, trial, clips, study)
    for file in files:
        console.print(str(file), soft_wrap=True)
    return {"figures": [str(file) for file in files]}
