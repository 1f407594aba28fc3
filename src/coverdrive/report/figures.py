"""All pictures of a results folder."""

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from coverdrive.files import number_in_name
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.prediction.segments import Segments
from coverdrive.report import style
from coverdrive.report.affordance_figure import affordance_figure
from coverdrive.report.animation import animate
from coverdrive.report.basis_figure import basis_figure
from coverdrive.report.binding import Binding
from coverdrive.report.collisions_figure import collisions_figure
from coverdrive.report.contents import Contents
from coverdrive.report.planning_figure import planning_figure
from coverdrive.report.risk_figure import risk_figure
from coverdrive.report.scores_figure import scores_figure
from coverdrive.report.set_sizes_figure import set_sizes_figure
from coverdrive.report.size_figure import size_figure
from coverdrive.report.snapshots import snapshots
from coverdrive.report.speed_and_gap_figure import speed_and_gap_figure
from coverdrive.simulation.trace import Trace


def draw_all(contents: Contents, folder: Path, progress: Callable[[float], None] | None = None) -> list[Path]:
    """Draw everything that there are results for; figures go to ``folder``, each as PNG and PDF.

    Args:
        contents: of a results folder; snapshots are drawn of its first trace.
        folder: of the figures.
        progress: called with the share that is drawn.

    Returns:
        The files.
    """
    basis, learned = contents.predictor.basis, contents.learned
    drawings: dict[str, Callable[[], Figure]] = {
        "affordance": affordance_figure,
        "basis": lambda: basis_figure(basis, learned.base_share, learned.examples),
        "scores": lambda: scores_figure(learned, contents.predictor.rule),
        "set_sizes": lambda: set_sizes_figure(learned),
    }
    if any(each.certificate for each in contents.compared):
        drawings["methods"] = lambda: risk_figure(contents.compared)
    trials = contents.trials
    if trials is not None:
        drawings["collisions"] = lambda: collisions_figure(trials)
        drawings["speed_and_gap"] = lambda: speed_and_gap_figure(trials)
        drawings["planning"] = lambda: planning_figure(trials, contents.period)
    for trace in list(contents.traces.values())[:1]:
        drawings["snapshots"] = lambda trace=trace: snapshots(trace, binding=contents.binding)
    files: list[Path] = []
    for number, (name, draw) in enumerate(drawings.items(), start=1):
        files += style.save(draw(), folder / name)
        if progress is not None:
            progress(number / len(drawings))
    return files


def draw_drive(trace: Trace, folder: Path, binding: Binding, progress: Callable[[float], None] | None = None) -> None:
    """Draw snapshots and a video of one drive into a folder."""
    style.save(snapshots(trace, binding=binding), folder / "snapshots")
    animate(trace, folder / "drive.mp4", progress, binding)


def draw_bases(studied: Sequence[StudiedBasis], segments: Segments, folder: Path) -> None:
    """Draw the size of bases against ε, and every basis, into a folder."""
    style.save(size_figure(studied), folder / "size")
    for each in studied:
        figure = basis_figure(each.basis, each.share, segments.points)
        style.save(figure, folder / f"basis_{number_in_name(each.basis.radius)}")
