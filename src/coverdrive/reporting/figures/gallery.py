"""All figures of a report, each from the one file of its result."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure as Drawn

from coverdrive.files import number_in_name
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.prediction.data.segments import Segments
from coverdrive.progress import done, stage
from coverdrive.reporting.contents import Contents
from coverdrive.reporting.drives.animation import animate
from coverdrive.reporting.drives.snapshots import snapshots
from coverdrive.reporting.figures.affordance import affordance_figure
from coverdrive.reporting.figures.basis import basis_figure, size_figure
from coverdrive.reporting.figures.frontier import frontier_figure
from coverdrive.reporting.figures.league import league_figure
from coverdrive.reporting.figures.learned import areas_figure, losses_figure, scores_figure, set_sizes_figure
from coverdrive.reporting.figures.risk import risk_figure
from coverdrive.reporting.figures.study import collisions_figure, drives_figure, planning_figure
from coverdrive.reporting.plotting.drawing import save
from coverdrive.reporting.plotting.figure import Figure
from coverdrive.simulation.drives.trace import Trace


def figures_of(contents: Contents) -> dict[str, Figure]:
    """The figure of every result that there is, by its name."""
    learned, trials = contents.learned, contents.driven
    figures = {"areas": areas_figure(contents.certified.occupied), "losses": losses_figure(learned)}
    if contents.predictor.basis is not None:
        figures |= {
            "basis": basis_figure(contents.predictor.basis, learned.base_share, learned.examples),
            "scores": scores_figure(learned, contents.predictor.rule),
            "set_sizes": set_sizes_figure(learned),
        }
    if any(each.certificate for each in contents.compared):
        figures["methods"] = risk_figure(contents.compared)
    if contents.dialled is not None:
        figures["dial"] = frontier_figure(contents.dialled.frontier)
    if contents.league is not None and (shown := league_figure(contents.league)):
        figures["league"] = shown
    if trials is not None:
        figures["collisions"] = collisions_figure(trials, contents.replayed)
        figures["drives"] = drives_figure(trials)
        figures["planning"] = planning_figure(trials, contents.period)
    return figures


def draw_all(contents: Contents, folder: Path) -> list[Path]:
    """Draw everything that there are results for into a folder, as PNG and PDF, with snapshots of the first trace."""
    files: list[Path] = []
    with stage("figures"):
        figures: dict[str, Figure | Drawn] = {**figures_of(contents), "affordance": affordance_figure()}
        for trace in list(contents.traces.values())[:1]:
            figures["snapshots"] = snapshots(trace, problem=contents.problem)
        for number, (name, figure) in enumerate(figures.items(), start=1):
            files += save(figure, folder / name)
            done(number, len(figures))
    return files


def draw_drive(trace: Trace, folder: Path, problem: ProblemSettings | None) -> None:
    """Draw snapshots and a video of one drive into a folder."""
    save(snapshots(trace, problem=problem), folder / "snapshots")
    animate(trace, folder / "drive.mp4", problem)


def draw_bases(studied: Sequence[StudiedBasis], segments: Segments, folder: Path) -> None:
    """Draw the size of bases against ε, and every basis, into a folder."""
    save(size_figure(studied), folder / "size")
    for each in studied:
        save(
            basis_figure(each.basis, each.share, segments.points), folder / f"basis_{number_in_name(each.basis.radius)}"
        )
