"""``coverdrive figures``: figures for a paper."""

from pathlib import Path
from typing import Any

from coverdrive.cli.options import Folder, Trial, console
from coverdrive.progress import stages


def figures(folder: Folder = Path("results"), *, trial: Trial = None) -> dict[str, Any]:
    """Draw all figures of a results folder, as PDF (vectors) and PNG."""
    from coverdrive.pictures import draw_figures

    with stages() as bars:
        files = draw_figures(folder, bars.report, trial)
    for file in files:
        console.print(str(file), soft_wrap=True)
    return {"figures": [str(file) for file in files]}
