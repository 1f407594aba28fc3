"""All pictures of a results folder."""

from collections.abc import Callable, Sequence
from pathlib import Path

import polars as pl

from coverdrive.prediction.basis_study import StudiedBasis
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.segments import Segments
from coverdrive.report import style
from coverdrive.report.animation import animate
from coverdrive.report.basis_figure import basis_figure
from coverdrive.report.collisions_figure import collisions_figure
from coverdrive.report.size_figure import size_figure
from coverdrive.report.snapshots import snapshots
from coverdrive.simulation.trace import Trace


def draw_run(
    fit: Fit, trials: pl.DataFrame, trace: Trace, folder: Path, progress: Callable[[float], None] | None = None
) -> None:
    """Draw the basis, the collisions of a study, and one of its drives.

    Args:
        fit: the predictor and its training segments.
        trials: one row for each trial of the study.
        trace: one of the trials.
        folder: of the results.
        progress: called with the share of the video that is written.
    """
    segments = fit.segments.points[fit.split.train]
    style.save(basis_figure(fit.predictor.basis, fit.base_share, segments), folder / "figures" / "basis")
    style.save(collisions_figure(trials), folder / "figures" / "collisions")
    draw_drive(trace, folder / "figures", progress)


def draw_drive(trace: Trace, folder: Path, progress: Callable[[float], None] | None = None) -> None:
    """Draw snapshots and a video of one drive into a folder."""
    style.save(snapshots(trace), folder / "snapshots")
    animate(trace, folder / "drive.mp4", progress)


def draw_bases(studied: Sequence[StudiedBasis], segments: Segments, folder: Path) -> None:
    """Draw the size of bases against ε, and every basis, into a folder."""
    style.save(size_figure(studied), folder / "size")
    for each in studied:
        figure = basis_figure(each.basis, each.share, segments.points)
        style.save(figure, folder / f"basis_{each.basis.epsilon:g}")
