"""From a results folder to what a person looks at: the page, the figures, the video of a drive."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Literal

from coverdrive import workflow
from coverdrive.errors import DataError
from coverdrive.progress import Listener
from coverdrive.report.animation import animate
from coverdrive.report.figures import draw_all
from coverdrive.report.page.page import write_page
from coverdrive.results import (
    STUDY,
    binding_of,
    has_trials,
    load_contents,
    load_experiment,
    load_predictor,
    load_trials,
)
from coverdrive.simulation.notable import liveliest, notable
from coverdrive.simulation.replay import Clip
from coverdrive.simulation.trace import Trace

Clips = Callable[[], Sequence[Clip]]
"""reads the recorded scenes that a study replayed; called if a drive has to be driven again"""

Format = Literal["mp4", "gif"]


def write_report(
    folder: Path,
    progress: Listener,
    named: Sequence[int] = (),
    most: int = 8,
    clips: Clips = tuple,
    study: str = STUDY,
) -> Path:
    """Write the page of a results folder.

    Args:
        folder: of the results.
        progress: called with the stage and the share of it that is done.
        named: trials to replay in any case.
        most: number of notable trials to replay at most.
        clips: reads the recorded scenes, if the study replayed some.
        study: name of the study's folder.

    Returns:
        The HTML file.

    Raises:
        DataError: there is no fit in the folder, or no such trial.
    """
    traces = _traces(folder, study, _replayed(folder, study, named, most), progress, clips)
    path = folder / f"{study.replace(STUDY, 'report', 1)}.html"
    write_page(load_contents(folder, traces, study), path, partial(progress, "report"))
    return path


def draw_figures(
    folder: Path, progress: Listener, trial: int | None = None, clips: Clips = tuple, study: str = STUDY
) -> list[Path]:
    """Draw every figure that the folder has results for, as PDF and PNG.

    Args:
        folder: of the results.
        progress: called with the stage and the share of it that is done.
        trial: whose snapshots are drawn; the liveliest, if left out.
        clips: reads the recorded scenes, if the study replayed some.
        study: name of the study's folder.

    Returns:
        The files.

    Raises:
        DataError: there is no fit in the folder, or no such trial.
    """
    if trial is None:
        drawn = [liveliest(load_trials(folder, study))] if has_trials(folder, study) else []
    else:
        drawn = _replayed(folder, study, [trial], 0)
    traces = _traces(folder, study, drawn, progress, clips)
    return draw_all(load_contents(folder, traces, study), _figures(folder, study), partial(progress, "figures"))


def animate_trial(
    folder: Path,
    progress: Listener,
    trial: int | None,
    file_format: Format,
    clips: Clips = tuple,
    study: str = STUDY,
) -> Path:
    """Write the video of a drive.

    Args:
        folder: of the results.
        progress: called with the stage and the share of it that is done.
        trial: which; the liveliest, if left out.
        file_format: of the video.
        clips: reads the recorded scenes, if the study replayed some.
        study: name of the study's folder.

    Returns:
        The file.

    Raises:
        DataError: there is no fit in the folder, or no such trial.
    """
    number = liveliest(load_trials(folder, study)) if trial is None else _replayed(folder, study, [trial], 0)[0]
    trace = _traces(folder, study, [number], progress, clips)[number]
    path = _figures(folder, study) / f"drive_{number}.{file_format}"
    animate(trace, path, partial(progress, "video"), binding_of(load_experiment(folder, study)))
    return path


def _figures(folder: Path, study: str) -> Path:
    """Where the figures of a study go: each study has its own."""
    return folder / study.replace(STUDY, "figures", 1)


def _traces(folder: Path, study: str, trials: Sequence[int], progress: Listener, clips: Clips) -> dict[int, Trace]:
    experiment, predictor = load_experiment(folder, study), load_predictor(folder)
    return workflow.drives(experiment, predictor, folder / study, trials, partial(progress, "drives"), clips)


def _replayed(folder: Path, study: str, named: Sequence[int], most: int) -> list[int]:
    """The named trials, then the notable ones of the study."""
    if not has_trials(folder, study):
        _refuse_unknown([trial for trial in named if trial < 0], "are numbered from 0")
        return list(named)
    trials = load_trials(folder, study)
    driven = trials["trial"].to_list()
    _refuse_unknown([trial for trial in named if trial not in driven], f"of the study are 0 to {max(driven)}")
    return list(dict.fromkeys([*named, *notable(trials, most)]))


def _refuse_unknown(unknown: Sequence[int], known: str) -> None:
    if unknown:
        raise DataError(f"trials {known}, got {unknown[0]}; name one of them; `coverdrive drive` drives any other")
