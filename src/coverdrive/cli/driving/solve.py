"""``coverdrive solve``: planning problems of CommonRoad scenarios."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console, experiment_in, experiment_of, processes
from coverdrive.errors import DataError, SettingError
from coverdrive.progress import stage

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.driving.solving import Drive
    from coverdrive.prediction.predictor import AnyPredictor
    from coverdrive.results import Results


def solve(
    *scenario: Annotated[Path, Parameter(help="CommonRoad scenarios, as in `USA_US101-9_1_T-1.xml`, or folders.")],
    predictor: Annotated[
        Path | None,
        Parameter(help="Results folder whose predictor drives, as in `--predictor us101`; else one is fitted."),
    ] = None,
    recording: options.Recordings = None,
    leave_one_out: Annotated[
        bool,
        Parameter(help="Fit for each scenario on the recordings that show nothing of it, nor of others on its map."),
    ] = False,
    model: Annotated[
        Literal["KS", "ST"],
        Parameter(help="Model of the car: kinematic single-track, or single-track with slip; as in `--model ST`."),
    ] = "KS",
    workers: options.Workers = None,
    video: Annotated[
        bool,
        Parameter(
            help="Draw snapshots and a video of every drive; what is solved already but has none is driven again.",
        ),
    ] = False,
    seed: options.Seed = None,
    out: Annotated[Path, Parameter(help="Folder of the solutions, as in `--out solutions`.")] = Path("solutions"),
    config: options.Config = None,
    settings: Annotated[
        options.Set,
        Parameter(
            help="Settings of the planner, and of the fit where one is made, by their names in config.toml, as in "
            "`--set planner.manners.like=regulation`. Those of episodes, traffic and studies have no effect, nor have "
            "those of the ego's size and wanted speed, which are as the car and the problem say."
        ),
    ] = None,
) -> dict[str, Any]:
    """Drive planning problems of CommonRoad scenarios, told no more than the present, and write their solutions.

    Each is written when it is made, and not made again with the same settings. What cannot be read or driven is a row
    of the table with its reason; the exit status is 3 then.

    Solutions are in the official XML format, for a BMW 320i. The drivability checker judges them if it is installed, by
    `pip install '.[commonroad]'`.

    For example:

    - with a predictor that there is, which has not seen them: `coverdrive solve scenarios/ --predictor us101`
    - none has seen its own scene: `coverdrive solve scenarios/ --recording scenarios/ --leave-one-out`
    """
    with waiting():
        from coverdrive.recordings.files.scenario import PROTOBUF, is_protobuf, scenarios_in
    for path in scenario:
        if not path.is_file() and not path.is_dir():
            raise DataError(f"{path}: there is no such scenario; check the path")
    files = scenarios_in(scenario)
    if not files:
        why = f"; {PROTOBUF}" if any(map(is_protobuf, scenario)) else ""
        example = "name a scenario or a folder, as in `coverdrive solve scenarios/`"
        raise DataError(f"there is nothing to solve; {example}{why}")
    if predictor is not None and (recording or leave_one_out):
        raise SettingError("--predictor names one that is fitted; leave out --recording and --leave-one-out")
    if leave_one_out and not recording:
        raise SettingError("--leave-one-out is about recordings; name some, as in `--recording scenarios/`")
    with waiting():
        from coverdrive.driving.batch import solve_all
        from coverdrive.reporting.tables.summaries import solved_table
        from coverdrive.results import Results
    fitted = None if predictor is None else Results(predictor)
    given: dict[str, Any] = {"config": config, "settings": settings, "seed": seed, "study": {"workers": workers}}
    experiment = experiment_in(fitted, None, **given) if fitted else experiment_of(**given)
    workers = processes(experiment.study)
    with stages(kept="solutions"):
        predictor_of = _predictors(files, fitted, recording or [], leave_one_out, experiment, out)
        draw = partial(_draw, out) if video else None
        each = solve_all(files, predictor_of, out, model, workers, draw, experiment.planner)
        found = [row for rows in each for row in rows]
    console.print(solved_table(found))
    console.print(f"Solutions and solved.csv are in {out}")
    undriven = [row["reason"] for row in found if row["time"] is None]
    return {"solutions": str(out), "problems": found, "undriven": undriven}


def _draw(folder: Path, drive: "Drive", scenario: str) -> str:
    """Draw a drive in a scenario of this name; the file of its video in the folder."""
    from coverdrive.reporting.figures.gallery import draw_drive

    name = f"{scenario}_{drive.problem.number}"
    draw_drive(drive.trace, folder / name, None)
    return f"{name}/drive.mp4"


def _predictors(
    files: Sequence[Path],
    fitted: "Results | None",
    paths: Sequence[Path],
    leave_one_out: bool,
    experiment: "Experiment",
    out: Path,
) -> "Callable[[Path], AnyPredictor]":
    """The predictor for each scenario: that of a results folder, or one fitted on recordings and kept beside."""
    if fitted is not None:
        with stage("shared scenes"):
            fitted.refuse_seen(files)
        return lambda _: fitted.predictor
    with waiting():
        from coverdrive.prediction.fits.left_out import fit_without, left_out
    made_of = experiment.recordings(paths), experiment.prediction, experiment.seed, out / "fits"
    with stage("shared scenes"):
        out_of = dict(zip(files, left_out(paths, files), strict=True)) if paths else {}
    if leave_one_out:
        return lambda file: fit_without(out_of[file], *made_of)
    for file, names in out_of.items():
        if names:
            raise DataError(
                f"{file} shows something of {len(names)} of the recordings ({', '.join(sorted(names)[:3])}), which "
                "would train or calibrate what drives it; fit without them by --leave-one-out, or give others"
            )
    usual = fit_without(frozenset(), *made_of)
    return lambda _: usual
