"""From a fit, a study or a league to what a person looks at: the page, the figures, the video of a drive."""

from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Literal

import polars as pl

from coverdrive.arguments import of_kind
from coverdrive.dialling.dial import said_of_dial
from coverdrive.errors import DataError
from coverdrive.files import write_text
from coverdrive.prediction.fit import Fit
from coverdrive.progress import done, stage
from coverdrive.reporting.claim import proved_by
from coverdrive.reporting.contents import Contents, Fitted
from coverdrive.reporting.drives.active_constraints import problem_of
from coverdrive.reporting.drives.animation import animate
from coverdrive.reporting.figures.gallery import draw_all
from coverdrive.reporting.figures.league import league_figure
from coverdrive.reporting.figures.risk import risk_figure
from coverdrive.reporting.page.page import page, rendered
from coverdrive.reporting.plotting.drawing import save
from coverdrive.reporting.tables.league import league_of
from coverdrive.simulation.measures.notable import liveliest, notable
from coverdrive.simulation.studies.driven_on import driven_on
from coverdrive.simulation.studies.study import Study
from coverdrive.simulation.studies.workers import call_all

_REPLAYS = 8
"""notable trials that a page replays"""


def report(
    fitted: Fit | Fitted,
    study: Study | None = None,
    path: Path | str | None = None,
    *,
    trials: Sequence[int] = (),
    replays: int = _REPLAYS,
) -> Path:
    """Write one HTML page that shows everything and needs no network, with drives to replay.

    Args:
        fitted: a fit, or the `fitted` of the `coverdrive.results.Results` that it is in.
        study: that was driven with its predictor, if any.
        path: of the page; in the results folder if left out, or ``report.html``.
        trials: to replay in any case; DataError if one is none of the study.
        replays: number of notable trials to replay at most.

    Raises:
        SettingError: there is no fit, or what is given as a study is none.
        DataError: the study has no such trial.
    """
    whose = "what `fit` gives, or the `fitted` of a `coverdrive.results.Results`"
    of_kind("fitted", fitted, (Fit, Fitted), f"{whose}; a study is the second argument")
    if study is not None:
        of_kind("study", study, Study, "what `study` gives")
    file = Path(path) if path else _beside(fitted, study, "report").with_suffix(".html")
    write_text(file, page(contents_of(fitted, study, _replayed(study, trials, replays))))
    return file


def draw_figures(fitted: Fit | Fitted, study: Study | None = None, trial: int | None = None) -> list[Path]:
    """Draw every figure that there are results for, as PDF and PNG, with snapshots of a trial.

    That is the liveliest one, if none is named; DataError if there is no such trial.
    """
    return draw_all(contents_of(fitted, study, _one(study, trial)), _beside(fitted, study, "figures"))


def animate_drive(
    fitted: Fit | Fitted, study: Study, trial: int | None = None, file_format: Literal["mp4", "gif"] = "mp4"
) -> Path:
    """Write the video of a drive, of the liveliest one if no trial is named; DataError if there is none."""
    chosen = _one(study, trial) or [liveliest(study.trials)]
    path = _beside(fitted, study, "figures") / f"drive_{chosen[0]}.{file_format}"
    animate(study.trace(chosen[0]), path, problem_of(study))
    return path


def draw_everything(fitted: Fitted, study: Study, workers: int = 1) -> Path:
    """Draw all figures and the video of a study, and write its page, on so many processes; returns the page's path."""
    study.traces(list(dict.fromkeys([*_one(study, None), *_replayed(study, (), _REPLAYS)])))  # driven once, for all
    tasks = [partial(draw, fitted, study) for draw in (animate_drive, report, draw_figures)]
    with stage("figures, video and page") if workers > 1 else nullcontext():
        for number, _ in enumerate(call_all(tasks, workers), start=1):
            done(number, len(tasks))
    return _beside(fitted, study, "report").with_suffix(".html")


def draw_methods(fitted: Fitted) -> None:
    """Draw the comparison of all methods of calibration."""
    save(risk_figure(fitted.compared), fitted.folder / "figures" / "methods")


def write_league(table: pl.DataFrame, folder: Path) -> None:
    """Write ``league.html`` and the figure, as PNG and PDF, of a table of `coverdrive.league.table` into a folder."""
    figure = league_figure(table)
    if figure:
        save(figure, folder / "league")
    figures = {"league": figure} if figure else {}
    write_text(folder / "league.html", rendered("league-page", figures, league=league_of(table)))


def contents_of(fitted: Fit | Fitted, study: Study | None, replayed: Sequence[int]) -> Contents:
    """Everything that a report shows, with the trials that it replays."""
    known = vars(Fitted.of(fitted) if isinstance(fitted, Fit) else fitted)
    if study is None:
        return Contents(**known)
    other = "" if study.folder.name == "study" else f", {study.folder.name}"
    return Contents(
        **known | {"name": known["name"] + other},
        trials=study.files.table() if study.files.finished else None,
        traffic=study.setup.traffic_name,
        proved=proved_by(study) if study.files.finished and study.trials.height else "",
        replayed=study.setup.replays,
        unlike="".join(said_of_dial(known["dialled"], study.setup)[1:]),
        road=driven_on(study.setup),
        period=study.setup.episode.step,
        problem=problem_of(study),
        traces=study.traces(replayed),
    )


def _beside(fitted: Fit | Fitted, study: Study | None, name: str) -> Path:
    """Where the pictures of a study go in a results folder: each study has its own."""
    if isinstance(fitted, Fit):
        return Path(name)
    return fitted.folder / (study.folder.name.replace("study", name, 1) if study else name)


def _one(study: Study | None, trial: int | None) -> list[int]:
    """The named trial, else the liveliest of a study that was driven."""
    if trial is not None:
        return _replayed(study, [trial], 0)
    return [liveliest(study.trials)] if study and study.files.finished else []


def _replayed(study: Study | None, named: Sequence[int], most: int) -> list[int]:
    """The named trials, then the notable ones of the study."""
    if study is None:
        return []
    if not study.files.finished:
        if named and not study.files.exists:
            study.files.table()  # says that there is no study
        return list(named)
    trials = study.trials
    unknown = sorted(set(named) - set(trials["trial"]))
    if unknown:
        raise DataError(
            f"trials of the study are 0 to {trials['trial'].max()}, got {unknown[0]}; name one of them; "
            "`coverdrive drive` drives any other"
        )
    return list(dict.fromkeys([*named, *notable(trials, most)]))
