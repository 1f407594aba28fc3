"""``coverdrive league``: who drives best where, on equal seeds."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.driving.study import Cluster
from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console, experiment_in, processes

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.league.entrants import Known
    from coverdrive.league.problems import Problems
    from coverdrive.results import Results
    from coverdrive.simulation.studies.setup import Setup

_DENSE = (8, 10, 12)
"""numbers of aggressive drivers on the paper's road"""
_NUMBERS = f"3 4 5 6 7, among aggressive drivers on the paper's road {' '.join(map(str, _DENSE))},"


def league(
    fit: options.Folder = Path("results"),
    *,
    planners: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=True,
            help="Who drives, as in `--planners default idm-mobil my_module:factory`; all others are compared with the "
            "first. There are default, paper, paper-sets, constant-velocity-box, constant-velocity, known-future, "
            "idm-mobil, idm, keep-velocity, own (that of a world of others), fiss-future and fiss-constant-velocity "
            "(on planning problems), and your own as module:factory.",
            show_default=lambda _: "all that make sense there but paper, which takes seconds for every step",
        ),
    ] = None,
    worlds: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=True,
            help="Where, as in `--worlds drivers replay highway-env-1 sumo-2000`. There are the traffics of "
            "`coverdrive study`, highway-env-1, highway-env-1.5, highway-env-2 (densities), sumo-1500 and sumo-2000 "
            "(vehicles/h on each lane), and planning problems as commonroad:scenarios/ (commonroad-st: for the dynamic "
            "vehicle model), with commas between several files, folders or patterns.",
            show_default=lambda _: "all traffics of `coverdrive study`, on another road but those that replay",
        ),
    ] = None,
    trials: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=1),
            help="Drives of each in every world, as in `--trials 100`; of planning problems at most all of them.",
        ),
    ] = 40,
    duration: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0),
            help="Seconds of a drive at the most, as in `--duration 10`; else 20 s in our traffics, 40 s in "
            "highway-env, 4 km in SUMO.",
        ),
    ] = None,
    recording: Annotated[
        options.Recordings,
        Parameter(
            help="The recordings that the fit was made from, as in `--recording scenarios/`, for replay and paper; on "
            "planning problems, fits then leave out what shows them."
        ),
    ] = None,
    paper: Annotated[
        Path | None,
        Parameter(
            help="Results folder of `coverdrive fit --preset paper` on the same recordings, as in `--paper paper-fit`; "
            "else it is made if the planners paper or paper-sets are to drive.",
        ),
    ] = None,
    road: options.RoadOfStudy = None,
    vehicles: Annotated[options.Vehicles, Parameter(show_default=options.usually(_NUMBERS))] = None,
    seed: options.Seed = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="Folder of the league, as in `--out league`.", show_default=lambda _: "`league` in that of the fit"
        ),
    ] = None,
    workers: options.Workers = None,
    cluster: Cluster = None,
) -> dict[str, Any]:
    """Drive named planners in named worlds on equal seeds; a league that was stopped goes on where it was.

    For example:

    - everybody in all traffics: `coverdrive league us101 --recording scenarios/ --trials 100`
    - against the driver of another simulator: `coverdrive league us101 --planners default own --worlds sumo-1500`
    - on CommonRoad: `coverdrive league us101 --recording scenarios/ --worlds commonroad:scenarios/`
    - with a planner of your own: `coverdrive league us101 --planners default my_module:factory --worlds drivers`
    """
    with waiting():
        from coverdrive.league.entrants import ON_PROBLEMS, USUAL
        from coverdrive.league.league import check_names
        from coverdrive.league.league import league as drive
        from coverdrive.league.problems import is_problems, problems_of
        from coverdrive.locks import alone
        from coverdrive.reporting.report import write_league
        from coverdrive.reporting.tables.league import league_tables
        from coverdrive.results import LEAGUE, Results
        from coverdrive.simulation.traffic.registry import NAMES
        from coverdrive.simulation.traffic.replay import REPLAYS
    results = Results(fit)
    recording = recording or []
    worlds = worlds or [name for name in NAMES if results.can_replay(recording, road) or name not in REPLAYS]
    posed = [name for name in worlds if is_problems(name)]
    planners = planners or list(
        dict.fromkeys([*(USUAL if len(posed) < len(worlds) else []), *(ON_PROBLEMS if posed else [])])
    )
    check_names(planners, worlds)
    results.check_replay(worlds, [], road)
    problems = {name: problems_of(name) for name in posed}
    size = {"workers": workers, "vehicles": vehicles}
    experiment = experiment_in(results, road, seed=seed, study=size, episode={"duration": duration})
    folder = out or fit / LEAGUE
    with stages(kept="finished drives"), alone(folder):
        known = results.known(planners, experiment.planner, recording, paper, out)
        if recording and posed:
            problems = _unseen(results, known, problems, recording, planners, folder)
        elif posed:
            results.refuse_seen(sorted({file for each in problems.values() for file in each.files}))
        table = drive(
            _setups(results, experiment, [name for name in worlds if name in NAMES], recording, vehicles is not None),
            known,
            folder,
            planners=planners,
            worlds=worlds,
            trials=trials,
            seed=experiment.seed,
            duration=duration,
            problems=problems,
            workers=processes(experiment.study),
            cluster=cluster,
        )
    write_league(table, folder)
    for each in league_tables(table):
        console.print(each)
    console.print(f"The table is {folder / 'league.csv'}, every drive is in drives.csv, and the page is league.html")
    return {"league": str(folder), "table": table.to_dicts()}


def _setups(
    results: "Results", experiment: "Experiment", worlds: list[str], recording: list[Path], said: bool
) -> "dict[str, Setup]":
    """Studies of the default in our traffics; the numbers of vehicles are ``said``, or may be others where they are as
    on the paper's road.
    """
    from coverdrive.simulation.roads.initial import VEHICLES

    setups: dict[str, Setup] = {}
    for name in worlds:
        dense = name == "aggressive" and not said and tuple(experiment.study.vehicles) == VEHICLES
        changed = experiment.updated({"traffic": {"kind": name}, "study": {"vehicles": _DENSE if dense else None}})
        setups[name] = results.study(changed, recording).setup.loaded()
    return setups


def _unseen(
    results: "Results",
    known: "Known",
    problems: "dict[str, Problems]",
    recording: list[Path],
    planners: list[str],
    folder: Path,
) -> "dict[str, Problems]":
    """The same with what entrants are made of that have not seen the problems, where they are made of anything."""
    from coverdrive.league.known import unseen_of

    boxed, experiment = "constant-velocity-box" in planners, results.experiment
    if not boxed and not any(name == "default" or ":" in name for name in planners):
        return problems
    recordings, fits = experiment.recordings(recording, stored=True), folder / "fits"
    made_of = recording, recordings, experiment.prediction, experiment.seed, fits
    return {
        name: replace(each, known=unseen_of(known, each.files, *made_of, boxed=boxed))
        for name, each in problems.items()
    }
