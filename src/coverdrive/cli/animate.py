"""``coverdrive animate``: the video of a drive."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.options import Folder, Trial, console
from coverdrive.progress import stages


def animate(
    folder: Folder = Path("results"),
    *,
    trial: Trial = None,
    format: Annotated[Literal["mp4", "gif"], Parameter(help="MP4 for players, GIF for slides and web pages.")] = "mp4",
) -> dict[str, Any]:
    """Write one drive of a results folder as a video that plays in real time."""
    from coverdrive.pictures import animate_trial

    with stages() as bars:
        path = animate_trial(folder, bars.report, trial, format)
    console.print(f"The video is {path}", soft_wrap=True)
    return {"video": str(path)}
