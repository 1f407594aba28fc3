import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from simulation_fakes import FAST, build_fakes, build_planner

from coverdrive.errors import DataError, SettingError
from coverdrive.simulation.statistics import widest_interval
from coverdrive.simulation.study import run_study
from coverdrive.simulation.trial import SCHEMA, WALL_TIMES, measure, run_trial

SCRIPT = Path(__file__).with_name("run_fake_study.py")
CLUSTER = Path(__file__).with_name("run_cluster_study.py")


def refuse_to_build():
    raise AssertionError("a finished trial was run again")


def test_trials_are_spread_evenly_and_written_one_by_one(tmp_path):
    table = run_study(build_fakes, FAST, tmp_path, trials=10, seed=1)
    assert table["trial"].to_list() == list(range(10))
    assert table["vehicles"].to_list() == [3, 4, 5, 6, 7] * 2
    assert dict(table.schema) == SCHEMA
    assert len(list((tmp_path / "trials").iterdir())) == 10
    assert pl.read_parquet(tmp_path / "trials.parquet").equals(table)
    one = measure(run_trial(build_fakes(), FAST, 6, 1, 3), 1, 3)
    row = table.row(3, named=True)
    assert {name: getattr(one, name) for name in SCHEMA if name not in WALL_TIMES} == {
        name: row[name] for name in SCHEMA if name not in WALL_TIMES
    }


def test_trials_differ_and_depend_on_the_seed(tmp_path):
    first = run_study(build_fakes, FAST, tmp_path / "1", trials=10, seed=1)
    second = run_study(build_fakes, FAST, tmp_path / "2", trials=10, seed=2)
    assert first["minimum_gap"].n_unique() > 5
    assert not np.array_equal(first["minimum_gap"], second["minimum_gap"])


def test_a_finished_study_is_not_run_again_and_can_be_continued(tmp_path):
    table = run_study(build_fakes, FAST, tmp_path, trials=4)
    assert run_study(refuse_to_build, FAST, tmp_path, trials=4).equals(table)
    assert run_study(refuse_to_build, FAST, tmp_path, trials=2).equals(table.head(2))
    assert run_study(build_fakes, FAST, tmp_path, trials=6).head(4).equals(table)


def test_progress_counts_what_was_finished_before(tmp_path):
    run_study(build_fakes, FAST, tmp_path, trials=2)
    calls = []
    run_study(build_fakes, FAST, tmp_path, trials=4, progress=lambda *call: calls.append(call))
    assert calls == [(2, 4), (3, 4), (4, 4)]


def test_another_configuration_is_refused_by_name(tmp_path):
    run_study(build_fakes, FAST, tmp_path, trials=1, configuration={"planner": {"horizon": 3.0}})
    with pytest.raises(DataError, match=r"configuration.planner.horizon 3.0, now 2.0"):
        run_study(build_fakes, FAST, tmp_path, trials=1, configuration={"planner": {"horizon": 2.0}})
    with pytest.raises(DataError, match=r"seed 0, now 1"):
        run_study(build_fakes, FAST, tmp_path, trials=1, seed=1, configuration={"planner": {"horizon": 3.0}})
    with pytest.raises(DataError, match=r"episode.step 0.1, now 0.05"):
        other = FAST.model_copy(update={"step": 0.05})
        run_study(build_fakes, other, tmp_path, trials=1, configuration={"planner": {"horizon": 3.0}})
    assert json.loads((tmp_path / "study.json").read_text(encoding="utf-8"))["seed"] == 0


def test_a_folder_that_holds_something_else_is_refused(tmp_path):
    (tmp_path / "study.json").write_text("not json", encoding="utf-8")
    with pytest.raises(DataError, match="not the description of a study"):
        run_study(build_fakes, FAST, tmp_path, trials=1)


@pytest.mark.parametrize("wrong", [{"trials": 0}, {"workers": 0}, {"batch": 0}, {"vehicles": ()}])
def test_empty_studies_are_refused(tmp_path, wrong):
    with pytest.raises(SettingError, match="a study needs at least one"):
        run_study(build_fakes, FAST, tmp_path, **wrong)


def test_a_failing_trial_leaves_the_finished_ones(tmp_path):
    class Unlucky:
        def __init__(self, planner):
            self.planner, self.episodes = planner, 0

        dt, steps = 0.25, 12

        def reset(self, period):
            self.episodes += 1

        def plan(self, *arguments):
            if self.episodes == 3:
                raise RuntimeError("out of luck")
            return self.planner.plan(*arguments)

    def build():
        parts = build_fakes()
        return parts._replace(planner=Unlucky(parts.planner))

    with pytest.raises(RuntimeError, match="out of luck"):
        run_study(build, FAST, tmp_path, trials=5)
    assert sorted(path.stem for path in (tmp_path / "trials").iterdir()) == ["000000", "000001"]
    assert run_study(build_fakes, FAST, tmp_path, trials=5).height == 5


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_workers(tmp_path):
    alone = run_study(build_fakes, FAST, tmp_path / "1", trials=12, seed=3)
    together = run_study(build_fakes, FAST, tmp_path / "4", trials=12, seed=3, workers=4)
    assert together.drop(WALL_TIMES).equals(alone.drop(WALL_TIMES))


@pytest.mark.slow
def test_drives_of_the_planner_do_not_depend_on_the_number_of_workers(tmp_path):
    alone = run_study(build_planner, FAST, tmp_path / "1", trials=8, seed=3)
    together = run_study(build_planner, FAST, tmp_path / "4", trials=8, seed=3, workers=4)
    assert alone["share_solved"].max() > 0 and alone["mean_speed"].n_unique() == 8
    assert together.drop(WALL_TIMES).equals(alone.drop(WALL_TIMES))


@pytest.mark.slow
def test_code_that_was_just_compiled_drives_like_code_that_was_kept(tmp_path):
    script = (
        "from simulation_fakes import FAST, build_planner; from coverdrive.simulation.trial import run_trial; "
        "print([run_trial(build_planner(), FAST, 5, 3, trial).scene.states[-1].tolist() for trial in range(3)])"
    )
    path = os.pathsep.join([str(SCRIPT.parent), *sys.path])
    ends = [
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path)},
        ).stdout
        for _ in range(2)
    ]  # fmt: skip
    assert list(tmp_path.rglob("search._search-*.nbc"))
    assert ends[0] == ends[1] and ends[0].startswith("[[[")


def test_a_study_stops_after_the_batch_that_makes_its_intervals_narrow_enough(tmp_path):
    def run(name, until_width, batch):
        return run_study(build_fakes, FAST, tmp_path / name, trials=30, until_width=until_width, batch=batch)

    full = run("full", 1e-9, 8)
    assert full.height == 30
    widths = [widest_interval(full.head(size)) for size in (8, 16, 24, 30)]
    stopped = run("stopped", widths[1] + 1e-9, 8)
    expected = next(size for size, width in zip((8, 16, 24, 30), widths, strict=True) if width <= widths[1] + 1e-9)
    assert stopped.height == expected
    assert stopped.drop(WALL_TIMES).equals(full.head(expected).drop(WALL_TIMES))
    assert pl.read_parquet(tmp_path / "stopped" / "trials.parquet").height == expected
    assert run_study(refuse_to_build, FAST, tmp_path / "full", trials=30, until_width=widths[1] + 1e-9, batch=8).equals(
        full.head(expected)
    )


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL exists on POSIX systems only")
def test_a_cluster_that_loses_a_worker_loses_no_trial(tmp_path):
    process = subprocess.run(
        [sys.executable, str(CLUSTER), str(tmp_path / "cluster"), "24", "3"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(CLUSTER.parent), *sys.path])},
    )
    assert process.returncode == 0, process.stderr
    assert process.stdout.split() == ["killed", "survivors", "2"]
    table = pl.read_parquet(tmp_path / "cluster" / "trials.parquet")
    assert len(list((tmp_path / "cluster" / "trials").iterdir())) == 24
    alone = run_study(build_fakes, FAST, tmp_path / "alone", trials=24, seed=3)
    assert table.drop(WALL_TIMES).equals(alone.drop(WALL_TIMES))


def test_without_a_cluster_there_the_user_is_told_how_to_start_one(tmp_path):
    with pytest.raises(SettingError, match="no Dask scheduler answers at nowhere"):
        run_study(build_fakes, FAST, tmp_path, trials=2, cluster="nowhere://host")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL exists on POSIX systems only")
def test_a_killed_study_resumes_without_loss(tmp_path):
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), str(tmp_path), "400", "3", "1"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("5 "):
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
    resumed = run_study(build_fakes, FAST, tmp_path, trials=trials, seed=3)
    assert before == {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in before}
    assert len(list((tmp_path / "trials").iterdir())) == trials
    untouched = run_study(build_fakes, FAST, tmp_path / "fresh", trials=trials, seed=3)
    assert resumed.drop(WALL_TIMES).equals(untouched.drop(WALL_TIMES))
