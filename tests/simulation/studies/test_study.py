import inspect
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from simulation_fakes import FAST, REPLAYED, ConstantPlanner, fakes

import coverdrive
from coverdrive.errors import DataError, SettingError
from coverdrive.locks import alone
from coverdrive.planning.planner import MpcPlanner
from coverdrive.progress import heard_by
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.drives.storage import load_trace
from coverdrive.simulation.measures.statistics import widest_interval
from coverdrive.simulation.measures.trial import SCHEMA, measure
from coverdrive.simulation.roads import initial
from coverdrive.simulation.studies.ahead import _CODE
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.study import Study, simulate
from coverdrive.simulation.traffic.model import TrafficStep
from coverdrive.simulation.traffic.motion import constant_velocity, with_states

SCRIPT = Path(__file__).with_name("run_fake_study.py")
CLUSTER = Path(__file__).with_name("run_cluster_study.py")
pytestmark = pytest.mark.usefixtures("uncollected")

TIMES = ("planning_median", "planning_p99", "planning_maximum", "planning_wall_p99")
"""columns that depend on the machine, not only on the seed"""


def run(folder, trials, setup=None, **options) -> pl.DataFrame:
    return Study(setup or fakes(), folder).run(trials, **options).trials


def refuse_to_build():
    raise AssertionError("a finished trial was run again")


def test_trials_are_spread_evenly_and_written_one_by_one(tmp_path):
    setup = fakes(seed=1)
    table = run(tmp_path, 10, setup)
    assert table["trial"].to_list() == list(range(10))
    assert table["vehicles"].to_list() == [3, 4, 5, 6, 7] * 2
    assert dict(table.schema) == SCHEMA
    assert len(list((tmp_path / "trials").iterdir())) == 10
    assert pl.read_parquet(tmp_path / "trials.parquet").equals(table)
    one = measure(setup.drive(3), 1, 3)
    row = table.row(3, named=True)
    assert {name: one[name] for name in SCHEMA if name not in TIMES} == {
        name: row[name] for name in SCHEMA if name not in TIMES
    }


def test_one_drive_in_one_call_is_that_of_a_study():
    setup = fakes(seed=1)
    one = simulate(setup.predictor, ConstantPlanner, vehicles=6, seed=1, trial=3, episode=FAST)
    assert np.array_equal(one.scene.states, setup.drive(3).scene.states)


def test_trials_differ_and_depend_on_the_seed(tmp_path):
    first = run(tmp_path / "1", 4, fakes(seed=1))
    second = run(tmp_path / "2", 4, fakes(seed=2))
    assert first["minimum_gap"].n_unique() > 2
    assert not np.array_equal(first["minimum_gap"], second["minimum_gap"])


def test_a_finished_study_is_not_run_again_and_can_be_continued(tmp_path, monkeypatch):
    table = run(tmp_path, 4)
    with monkeypatch.context() as patch:
        patch.setattr(ConstantPlanner, "plan", refuse_to_build)
        assert run(tmp_path, 4).equals(table)
        assert run(tmp_path, 2).equals(table.head(2))
    assert run(tmp_path, 6).head(4).equals(table)


def test_a_number_of_trials_is_fixed_unless_another_one_follows(tmp_path):
    study = Study(fakes(), tmp_path / "fixed")
    for trials, anytime in ((3, False), (3, False), (4, True), (4, True)):
        assert study.run(trials).files.anytime is anytime
    fewer = Study(fakes(), tmp_path / "fewer").run(3).run(2)
    early = Study(fakes(), tmp_path / "early").run(2, until_width=0.9)
    assert fewer.files.anytime and early.files.anytime and early.run(2).files.anytime


def test_a_killed_study_has_the_number_of_trials_that_it_was_begun_with(tmp_path):
    with pytest.raises(RuntimeError, match="out of luck"):
        run(tmp_path, 3, fakes(planner=Unlucky()))
    assert not Study(fakes(), tmp_path).run(3).files.anytime
    with pytest.raises(RuntimeError, match="out of luck"):
        run(tmp_path / "less", 3, fakes(planner=Unlucky()))
    assert Study(fakes(), tmp_path / "less").run(2).files.anytime


def test_a_finished_study_of_which_only_the_rows_are_known_had_their_number(tmp_path):
    for trials, anytime in ((2, False), (3, True)):
        study = Study(fakes(), tmp_path / str(trials)).run(2)
        (study.folder / "planned.json").unlink()
        assert study.run(trials).files.anytime is anytime


def test_progress_counts_what_was_finished_before(tmp_path):
    run(tmp_path, 2)
    heard = []
    with heard_by(lambda *each: heard.append(each)):
        run(tmp_path, 4)
    assert {name for name, _ in heard} == {"closed-loop trials (4)"}
    assert [share for _, share in heard] == [0, 0.5, 0.75, 1, 1]


def test_another_configuration_is_refused_by_name(tmp_path):
    run(tmp_path, 1)
    with pytest.raises(DataError, match=r"seed 0, now 1"):
        run(tmp_path, 1, fakes(seed=1))
    with pytest.raises(DataError, match=r"planner None, now '.*partial', .*planner.name '.*ConstantPlanner', now None"):
        run(tmp_path, 1, fakes(planner=Slow))
    with pytest.raises(DataError, match=r"episode.step 0.1, now 0.05"):
        run(tmp_path, 1, replace(fakes(), episode=FAST.model_copy(update={"step": 0.05})))
    assert json.loads((tmp_path / "study.json").read_text(encoding="utf-8"))["seed"] == 0


class Slow(ConstantPlanner):
    __qualname__ = "partial"


class Pushing(ConstantPlanner):
    def __init__(self, push: float = 0.0):
        super().__init__()
        self.push, self.calls = push, 0

    def plan(self, state, paths, road):
        self.calls += 1
        return super().plan(state, paths, road)


def test_an_own_planner_that_was_changed_is_another_one(tmp_path, monkeypatch):
    """By what it was made with, or by its source; what it counts is no part of it."""
    planner = Pushing(1.0)
    for trials in (1, 2):
        run(tmp_path, trials, fakes(planner=planner))
    with pytest.raises(DataError, match=r"planner.push 1.0, now 2.0"):
        run(tmp_path, 2, fakes(planner=Pushing(2.0)))
    monkeypatch.setattr(inspect, "getsource", lambda _: "class Pushing: ...")
    with pytest.raises(DataError, match=r"planner.code '\w+', now '\w+'"):
        run(tmp_path, 2, fakes(planner=Pushing(1.0)))


def test_a_folder_that_holds_something_else_is_refused(tmp_path):
    for text in ("not json", "[1, 2]", '{"seed": 0}'):
        (tmp_path / "study.json").write_text(text, encoding="utf-8")
        with pytest.raises(DataError, match=r"study.json is not the description of a study"):
            run(tmp_path, 1)


class Brakes:
    """A traffic of one's own, whose vehicles brake more or less."""

    def reset(self, scene, road, rng):
        self.braking = rng.uniform(0.0, 1.0, scene.vehicles)

    def step(self, scene, dt):
        states = constant_velocity(scene.states, np.array([dt]))[:, 0]
        states[:, 2] = np.maximum(0.0, states[:, 2] - self.braking * dt)
        states[0] = scene.states[0]
        return TrafficStep.without_bases(with_states(scene, states))


@pytest.mark.slow
def test_an_own_traffic_and_an_own_planner_make_a_study(tmp_path):
    predictor = fakes().predictor
    study = coverdrive.study(
        predictor, ConstantPlanner, traffic=Brakes, episode=EpisodeSettings(duration=10.0), folder=tmp_path, trials=10
    )
    assert study.trials.height == 10
    assert set(study.trials["kind"]) == {"finished", "frontal"}  # careless, among vehicles that brake


@pytest.mark.parametrize("wrong", [{"trials": 0}, {"trials": 1, "workers": 0}, {"trials": 1, "batch": 0}])
def test_empty_studies_are_refused(tmp_path, wrong):
    with pytest.raises(SettingError, match="a study needs at least one"):
        run(tmp_path, **wrong)


def test_what_makes_no_trial_is_refused():
    with pytest.raises(SettingError, match="numbers of uncontrolled vehicles"):
        fakes(vehicles=())
    with pytest.raises(SettingError, match="no traffic is called 'bicycles'"):
        fakes(traffic="bicycles")


def test_a_trial_that_cannot_start_is_a_row_and_not_the_end(tmp_path, monkeypatch):
    monkeypatch.setattr(initial, "_ATTEMPTS", 200)
    crowded = fakes(vehicles=(3, 40), seed=1)
    study = Study(crowded, tmp_path).run(4)
    assert study.trials["vehicles"].to_list() == [3, 3]
    assert study.unstarted["trial"].to_list() == [1, 3]
    assert "could not be placed" in study.unstarted["reason"][0]
    assert study.collisions["trials"].to_list() == [2, 2]
    with pytest.raises(DataError, match=r"none of the 2 trials could start: 40 uncontrolled vehicles"):
        Study(fakes(vehicles=(40,)), tmp_path / "none").run(2)


def test_a_damaged_row_is_set_aside_and_driven_again(tmp_path):
    table, parts = run(tmp_path, 2), tmp_path / "trials"
    whole, other = ((parts / f"00000{trial}.parquet").read_bytes() for trial in (0, 1))
    for damaged in (whole.replace(b"PAR1", b"RAP1"), whole[:50], other):
        (parts / "000000.parquet").write_bytes(damaged)
        again = Study(fakes(), tmp_path).run(2)
        assert again.trials.drop(TIMES).equals(table.drop(TIMES))
        assert (parts / "000000.damaged").read_bytes() == damaged


def test_rows_and_tables_of_another_study_are_not_taken_for_its_own(tmp_path):
    """Whether they were copied, or their description was lost, or moved away while they were driven."""
    theirs = run(tmp_path / "theirs", 2)
    study = Study(fakes(vehicles=(5, 6)), tmp_path / "mine").run(2)
    ours = study.trials
    for name in ("trials.parquet", "trials/000001.parquet"):
        shutil.copy(tmp_path / "theirs" / name, tmp_path / "mine" / name)
    with pytest.raises(DataError, match=r"trials.parquet is of another study"):
        study.trials  # noqa: B018
    assert Study(fakes(vehicles=(5, 6)), tmp_path / "mine").run(2).trials.drop(TIMES).equals(ours.drop(TIMES))
    (tmp_path / "theirs" / "study.json").unlink()
    again = Study(fakes(vehicles=(5, 6)), tmp_path / "theirs").run(2)
    assert again.trials.drop(TIMES).equals(ours.drop(TIMES)) and not ours.drop(TIMES).equals(theirs.drop(TIMES))
    assert len(again.set_aside) == 2

    running = StudyFolder(tmp_path / "running")
    running.claim(fakes().description())
    (tmp_path / "running" / "study.json").unlink()
    running.save(theirs.row(0, named=True))
    assert len(Study(fakes(vehicles=(5, 6)), tmp_path / "running").run(1).set_aside) == 1


def test_a_damaged_trace_is_driven_again(tmp_path):
    study = Study(fakes(), tmp_path).run(1)
    driven = study.trace(0)
    (file,) = (tmp_path / "traces").glob("*.npz")
    file.write_bytes(file.read_bytes()[:1000])
    assert np.array_equal(study.trace(0).scene.states, driven.scene.states)
    assert np.array_equal(load_trace(file).scene.states, driven.scene.states)


def test_a_damaged_table_is_named(tmp_path):
    study = Study(fakes(), tmp_path).run(1)
    (tmp_path / "trials.parquet").write_bytes(b"PAR1")
    with pytest.raises(DataError, match=r"trials.parquet is damaged or of another version"):
        study.trials  # noqa: B018
    assert study.run(1).trials.height == 1


def test_drives_are_stored_for_the_next_look(tmp_path, monkeypatch):
    study = Study(fakes(), tmp_path).run(2)
    driven = study.trace(1)
    assert float(driven.scene.speed[:, 0].mean()) == study.trials["mean_speed"][1]
    monkeypatch.setattr(ConstantPlanner, "plan", refuse_to_build)
    assert np.array_equal(study.trace(1).scene.states, driven.scene.states)


class Unlucky(ConstantPlanner):
    __qualname__ = ConstantPlanner.__qualname__

    def plan(self, *arguments):
        if self.resets == 3:
            raise RuntimeError("out of luck")
        return super().plan(*arguments)


Unlucky.__module__ = ConstantPlanner.__module__


def test_a_failing_trial_leaves_the_finished_ones(tmp_path):
    with pytest.raises(RuntimeError, match="out of luck"):
        run(tmp_path, 5, fakes(planner=Unlucky()))
    assert sorted(path.stem for path in (tmp_path / "trials").iterdir()) == ["000000", "000001"]
    assert run(tmp_path, 5).height == 5


@pytest.mark.slow
def test_drives_do_not_depend_on_the_number_of_workers(tmp_path):
    alone = run(tmp_path / "1", 6, fakes(MpcPlanner(), seed=3))
    together = run(tmp_path / "2", 6, fakes(MpcPlanner(), seed=3), workers=2)
    assert alone["share_solved"].max() > 0 and alone["mean_speed"].n_unique() == 6
    assert together.drop(TIMES).equals(alone.drop(TIMES))


@pytest.mark.slow
def test_code_that_was_compiled_ahead_is_all_that_is_needed_and_drives_alike_once_it_is_kept(tmp_path):
    drive = (
        "from simulation_fakes import fakes; from coverdrive.planning.planner import MpcPlanner; "
        "from coverdrive.planning.solver.search import is_compiled; assert is_compiled(); "
        "setup = fakes(MpcPlanner(), vehicles=(5,), seed=3); "
        "print([setup.drive(trial).scene.states[-1].tolist() for trial in range(3)])"
    )
    path = os.pathsep.join([str(SCRIPT.parent), *sys.path])
    ends = [
        subprocess.run(
            [sys.executable, "-P", "-c", code, str(os.getpid())], capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path)},
        ).stdout
        for code in (f"{_CODE}; {drive}", drive)
    ]  # fmt: skip
    assert list(tmp_path.rglob("search._search-*.nbc"))
    assert ends[0] == ends[1] and ends[0].startswith("[[[")


def test_a_study_stops_after_the_batch_that_makes_its_intervals_narrow_enough(tmp_path):
    def run(name, until_width, batch):
        return Study(fakes(), tmp_path / name).run(11, until_width=until_width, batch=batch).trials

    full = run("full", 1e-9, 4)
    assert full.height == 11
    widths = [widest_interval(full.head(size)) for size in (4, 8, 11)]
    stopped = run("stopped", widths[1] + 1e-9, 4)
    expected = next(size for size, width in zip((4, 8, 11), widths, strict=True) if width <= widths[1] + 1e-9)
    assert stopped.height == expected
    assert stopped.drop(TIMES).equals(full.head(expected).drop(TIMES))
    assert pl.read_parquet(tmp_path / "stopped" / "trials.parquet").height == expected
    assert run("full", widths[1] + 1e-9, 4).equals(full.head(expected))


def test_two_at_once_do_not_drive_in_one_folder(tmp_path):
    with alone(tmp_path), pytest.raises(DataError, match="another process writes to"):
        run(tmp_path, 2)
    assert not list(tmp_path.iterdir())
    run(tmp_path, 2)
    with alone(tmp_path):
        assert Study(fakes(), tmp_path).trials.height == 2


def test_replays_have_no_interval_that_could_be_narrow_enough(tmp_path):
    study = Study(fakes(**REPLAYED), tmp_path)
    with pytest.raises(
        SettingError, match=r"until_width: replays .* no interval whose width .* leave it out, and say by"
    ):
        study.run(3, until_width=0.9)
    total = study.run(3).collisions.row(-1, named=True)
    assert (total["trials"], total["rear_end_low"], total["rear_end_high"]) == (3, None, None)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL exists on POSIX systems only")
def test_a_cluster_that_loses_a_worker_loses_no_trial(tmp_path):
    process = subprocess.run(
        [sys.executable, str(CLUSTER), str(tmp_path / "cluster"), "12", "3"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(CLUSTER.parent), *sys.path])},
    )
    assert process.returncode == 0, process.stderr
    assert process.stdout.split() == ["killed", "survivors", "2"]
    table = pl.read_parquet(tmp_path / "cluster" / "trials.parquet")
    assert len(list((tmp_path / "cluster" / "trials").iterdir())) == 12
    alone = run(tmp_path / "alone", 12, fakes(seed=3))
    assert table.drop(TIMES).equals(alone.drop(TIMES))


def test_without_a_cluster_there_the_user_is_told_how_to_start_one(tmp_path):
    with pytest.raises(SettingError, match="no Dask scheduler answers at nowhere"):
        run(tmp_path, 2, cluster="nowhere://host")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL exists on POSIX systems only")
def test_a_killed_study_resumes_without_loss(tmp_path):
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), str(tmp_path), "400", "3", "1"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line == "5\n":
            break
    process.send_signal(signal.SIGKILL)
    process.stdout.close()
    assert process.wait() == -signal.SIGKILL
    parts = [path for path in (tmp_path / "trials").glob("*.parquet") if not path.name.startswith(".")]
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in parts}
    assert 5 <= len(before) < 400
    (tmp_path / "trials" / ".000399.1.parquet").write_bytes(b"half a ro")
    time.sleep(0.05)
    trials = len(before) + 5
    resumed = run(tmp_path, trials, fakes(seed=3))
    assert before == {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in before}
    assert len(list((tmp_path / "trials").iterdir())) == trials
    untouched = run(tmp_path / "fresh", trials, fakes(seed=3))
    assert resumed.drop(TIMES).equals(untouched.drop(TIMES))
