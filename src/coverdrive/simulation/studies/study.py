"""Many seeded trials, on several processes, resumable (paper §5: 1000 trials, 200 each for 3 to 7 vehicles)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import polars as pl

from coverdrive.arguments import all_of, finite, of_kind, path_of, whole, wholes
from coverdrive.errors import DataError, SettingError
from coverdrive.locks import alone
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.progress import done, part, stage
from coverdrive.recordings.recording import Recording
from coverdrive.settings import merged
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.statistics import DEPENDENT, collision_table, widest_interval
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.predictor import Belief
from coverdrive.simulation.roads.places import check_replayed_road, place_of, recorded_place
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import MOST_VEHICLES, AnyPlanner, AnyTraffic, Setup
from coverdrive.simulation.studies.workers import Drives, run_trials
from coverdrive.simulation.traffic.replay import cut_scenarios


@dataclass(frozen=True, eq=False)
class Study:
    """A closed-loop study: its setup, and the folder that holds what was driven."""

    setup: Setup = field(repr=False)
    folder: Path

    @cached_property
    def files(self) -> StudyFolder:
        """What the folder holds."""
        return StudyFolder(self.folder)

    @cached_property
    def _read(self) -> Setup:
        """The setup with everything read that it needs."""
        return self.setup.loaded()

    @cached_property
    def _loaded(self) -> Setup:
        """The same; the folder is its own, or refuses it."""
        self.files.claim(self._read.description())
        return self._read

    @property
    def trials(self) -> pl.DataFrame:
        """One row of the `coverdrive.simulation.measures.trial.COLUMNS` for each trial that was driven, once all
        are.
        """
        return self.files.table().filter(STARTED)

    @property
    def unstarted(self) -> pl.DataFrame:
        """Number and reason of each trial that could not start."""
        return self.files.table().filter(~STARTED).select("trial", "vehicles", "reason")

    @property
    def set_aside(self) -> list[Path]:
        """Rows that are damaged or of another study, and were moved out of the way."""
        return self.files.set_aside

    @property
    def collisions(self) -> pl.DataFrame:
        """Collisions by number of uncontrolled vehicles, with intervals (`collision_table`)."""
        return collision_table(self.trials, self.setup.replays)

    def trace(self, trial: int) -> Trace:
        """Everything that happened in a trial: read if it was looked at before, else driven again and stored."""
        return self.traces([trial])[trial]

    def traces(self, trials: Sequence[int]) -> dict[int, Trace]:
        """Several such drives by the numbers of their trials; a DataError if the study replayed other recordings."""
        if trials and not self.files.exists:
            _ = self._loaded  # makes the folder its own
        traces, trials = dict[int, Trace](), [whole("trial", trial) for trial in trials]
        with stage("drives"):
            for number, trial in enumerate(trials):
                with part(number, len(trials)):
                    traces[trial] = self.files.trace(trial, self.setup.vehicles_of(trial), lambda: self._loaded)
        return traces

    def run(
        self,
        trials: int,
        *,
        workers: int = 1,
        cluster: str | None = None,
        until_width: float | None = None,
        batch: int = 50,
        name: str = "closed-loop trials",
    ) -> "Study":
        """Drive all trials that the folder does not hold yet; a study that was killed goes on where it was.

        A study may be continued with more trials: the first ones stay the same, and what all of them prove holds at any
        time, not only for a number that was fixed. Whether to stop early is asked after
        every ``batch`` of trials; ``name`` is of the stage that is reported, all else as in `study`.
        """
        if min(whole("trials", trials), whole("workers", workers), whole("batch", batch)) < 1:
            raise SettingError(
                f"a study needs at least one trial, worker and trial of a batch; got {trials} trials, {workers} "
                f"workers and batches of {batch}"
            )
        if until_width is not None and not 0 < finite("until_width", until_width) < 1:
            raise SettingError(f"until_width: expected a number between 0 and 1, got {until_width!r}")
        check_early_end(until_width, self.setup.replays)
        _ = self._read  # where it is refused, there is no folder
        with alone(self.folder):
            setup = self._loaded
            self.files.go_on(trials, early=until_width is not None)
            ends = [*range(batch, trials, batch), trials] if until_width else [trials]
            table = self.files.table_of([])
            with stage(f"{name} ({trials})"):
                for end in ends:
                    table = drive_missing(table, end, self.files, setup, workers, cluster, trials)
                    if until_width and widest_interval(table.filter(STARTED)) <= until_width:
                        break
            self.files.save_table(table)
        if not table.select(STARTED.any()).item():
            raise DataError(f"none of the {table.height} trials could start: {table['reason'][0]}")
        return self


def check_early_end(until_width: float | None, replays: bool) -> None:
    """Refuse, with a SettingError, that the width of intervals ends a study that has none."""
    if until_width is not None and replays:
        raise SettingError(
            f"until_width: {DEPENDENT} whose width could end a study, got {until_width!r}; leave it out, and say "
            "by trials how many to drive"
        )


def drive_missing(
    table: pl.DataFrame,
    end: int,
    files: StudyFolder,
    setup: Drives,
    workers: int = 1,
    cluster: str | None = None,
    last: int | None = None,
) -> pl.DataFrame:
    """The table of the first trials up to ``end``, for that of fewer: those are driven that the folder does not hold.

    ``last`` is the number of trials of which is told how many are done; all else as in `study`.
    """
    rows = dict(enumerate(table.iter_slices(1)))
    for trial in range(len(rows), end):
        if (kept := files.row_of(trial, setup.seed)) is not None:
            rows[trial] = kept
    done(len(rows), last or end)
    missing = [trial for trial in range(end) if trial not in rows]
    if missing and cluster is None and isinstance(setup, Setup) and isinstance(setup.planner, MpcPlanner):
        setup.planner.compile()  # here, where progress is heard, and not in every process
    for row in run_trials(setup, missing, workers, cluster):
        rows[row["trial"]] = files.save(row)
        done(len(rows), last or end)
    return pl.concat([rows[number] for number in range(end)])


def study(
    predictor: Belief,
    planner: AnyPlanner | None = None,
    *,
    folder: Path | str,
    trials: int = 20,
    traffic: AnyTraffic = "set-sampling",
    vehicles: int | Sequence[int] | None = None,
    seed: int = 0,
    recordings: Sequence[Recording] = (),
    road: str | None = None,
    episode: EpisodeSettings | None = None,
    workers: int = 1,
    cluster: str | None = None,
    until_width: float | None = None,
) -> Study:
    """Drive a study in a folder, or go on with it.

    With recordings it takes place on a road like theirs, as after ``coverdrive run --recording``; without, on the
    paper's.

    Args:
        predictor: of the ego.
        planner: of the ego, or what makes one in every process; if left out, ours, which wants the speed of the road.
        folder: of this study and no other; made as needed.
        trials: number of trials; the paper has 1000.
        traffic: ``set-sampling`` (the paper's), ``drivers``, ``aggressive``, ``mixed``, ``replay``,
            ``reactive-replay``, settings of one of them, or a model of your own.
        vehicles: number of uncontrolled vehicles, or several taken in turn by the trials, each 0 to 100; if left out,
            those of the road.
        seed: of the study.
        recordings: that are driven: on a road like theirs, or by replay themselves; those that are replayed should
            neither have trained nor calibrated the predictor.
        road: another one to drive on, ``paper`` or ``curved``.
        episode: start, length and time steps; what it does not set is as on the road.
        workers: number of processes, each on one thread; with 1, trials run in this process.
        cluster: address of a Dask scheduler whose workers drive instead, as in ``tcp://host:8786``.
        until_width: stop early, once both 95 % intervals of `collision_table` are at most this wide. This is decided
            after whole batches in the order of trials, so that it does not depend on the workers. Replays have no
            intervals, and refuse it.

    Raises:
        SettingError: a number makes no sense, replays are to end early, there is no such traffic or road, or no cluster
            there.
        DataError: the folder holds a study of another configuration, another process drives in it, no trial could
            start, or recorded traffic is to be replayed and there are no recordings.
    """
    setup = setup_of(predictor, planner, traffic, vehicles, seed, recordings, road, episode)
    return Study(setup, path_of("folder", folder)).run(
        trials, workers=workers, cluster=cluster, until_width=until_width
    )


def simulate(
    predictor: Belief,
    planner: AnyPlanner | None = None,
    *,
    traffic: AnyTraffic = "set-sampling",
    vehicles: int | None = None,
    seed: int = 0,
    trial: int = 0,
    recordings: Sequence[Recording] = (),
    road: str | None = None,
    episode: EpisodeSettings | None = None,
) -> Trace:
    """Drive once, as trial ``trial`` of a `study` with these arguments and one number of vehicles.

    If that is left out, it is the middle one of the road, five on the paper's.

    Raises:
        StartError: the vehicles cannot be placed.
        SettingError: there is no such traffic or road, or the planner looks farther than the predictor.
        DataError: recorded traffic is to be replayed, and there are no recordings.
    """
    numbers = None if vehicles is None else (whole("vehicles", vehicles),)
    setup = setup_of(predictor, planner, traffic, numbers, seed, recordings, road, episode)
    return replace(setup, vehicles=(setup.vehicles[len(setup.vehicles) // 2],)).drive(whole("trial", trial))


def setup_of(
    predictor: Belief,
    planner: AnyPlanner | None,
    traffic: AnyTraffic,
    vehicles: int | Sequence[int] | None,
    seed: int,
    recordings: Sequence[Recording],
    road: str | None,
    episode: EpisodeSettings | None,
) -> Setup:
    """The setup of `study` with these arguments: on a road like that of recordings, if no other is named."""
    recordings = all_of("recordings", recordings, Recording, "what `coverdrive.read` gives")
    like = recorded_place(recordings) if recordings else None
    place = place_of(road, like)[1]
    given = {}
    if episode is not None:
        given = of_kind("episode", episode, EpisodeSettings, "EpisodeSettings").model_dump(exclude_unset=True)
    setup = Setup(
        predictor,
        planner or MpcPlanner(PlannerSettings.model_validate(place.parts["planner"])),
        traffic,
        EpisodeSettings.model_validate(merged(place.parts["episode"], given)),
        place.vehicles if vehicles is None else wholes("vehicles", vehicles, 0, MOST_VEHICLES),
        seed,
        recorded=like and like.initial,
    )
    if not setup.replays:
        return setup
    check_replayed_road(road)
    return replace(setup, scenarios=cut_scenarios(recordings))
