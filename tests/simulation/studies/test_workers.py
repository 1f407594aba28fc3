"""How trials are run."""

import gc
import os
import time
from collections.abc import Generator
from functools import partial
from pathlib import Path

import pytest

from coverdrive.simulation.studies import workers
from coverdrive.simulation.studies.workers import call_all, end_processes, run_trials


class Looking:
    """Its rows say how many objects the garbage collector does not look at, and how many it does."""

    seed = 0

    def description(self):
        return {}

    def participants(self):
        return [[] for _ in range(1000)]

    def row(self, trial, participants):
        return {"trial": trial, "frozen": gc.get_freeze_count(), "looked at": len(gc.get_objects(generation=2))}


@pytest.fixture
def nothing_frozen() -> Generator[None]:
    gc.unfreeze()
    yield
    gc.unfreeze()
    workers._participants.clear()


def test_in_a_trial_the_collector_looks_at_nothing_that_was_there_before(nothing_frozen: None) -> None:
    before = len(gc.get_objects())
    rows = list(run_trials(Looking(), [0, 1], 1))
    for row in rows:
        assert row["frozen"] > max(1000, before / 2) and row["looked at"] < 1000
    assert gc.get_freeze_count() == 0


def test_in_a_worker_too_and_what_another_study_needed_is_collected(nothing_frozen: None) -> None:
    first, other = (workers._run_in_worker(Looking(), name, 0) for name in ("first", "other"))
    assert min(first["frozen"], other["frozen"]) > 1000
    assert other["frozen"] < first["frozen"] + 1000


def note_process(file: Path) -> None:
    file.write_text(str(os.getpid()))


@pytest.mark.parametrize("processes", [1, 2])
def test_functions_are_all_called_in_this_process_or_in_others(processes: int, tmp_path: Path) -> None:
    files = [tmp_path / str(number) for number in range(3)]
    assert len(list(call_all([partial(note_process, file) for file in files], processes))) == 3
    assert all((file.read_text() == str(os.getpid())) == (processes == 1) for file in files)


def test_who_stops_early_is_not_warned_of_what_is_left():
    calls = call_all([partial(time.sleep, 0.2)] * 6, 2)
    next(calls)
    calls.close()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_the_same_processes_serve_until_they_are_ended(tmp_path: Path) -> None:
    def called() -> set[str]:
        files = [tmp_path / str(number) for number in range(4)]
        assert len(list(call_all([partial(note_process, file) for file in files], 2))) == 4
        return {file.read_text() for file in files}

    first = called() | called()
    assert len(first) <= 2
    end_processes()
    assert not any(Path(f"/proc/{process}").exists() for process in first)
    assert not called() & first
