"""``coverdrive animate``: the video of a drive."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import Folder, Replayed, Studied, StudiedRoad, Trial, console


def animate(
    folder: Folder = Path("results"),
    *,
    trial: Trial = None,
    format: Annotated[
        Literal["mp4", "gif"],
        Parameter(help="MP4 for players, GIF for slides and web pages; as in `--format gif`."),
    ] = "mp4",
    traffic: Studied = None,
    road: StudiedRoad = None,
    recording: Replayed = None,
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
        path = animate_drive(results.fitted, results.driven_study(traffic, recording or [], road), trial, format)
    console.print(f"The video is {path}", soft_wrap=True)
    return {"video": str(path)}
