"""Workers end with the study that started them, however it ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

PATIENCE = 10.0
"""[s] until all workers of a stopped study must be gone, on a busy machine"""

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


def descendants(process: int) -> set[int]:
    """All processes that a process started, and those that they started."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, fields = stat.read_text().rpartition(")")
        except OSError:
            continue
        parents[int(name.split()[0])] = int(fields.split()[1])
    found, new = set[int](), {process}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return found


def alive(process: int) -> bool:
    try:
        _, _, fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")
    except OSError:
        return False
    return fields.split()[0] != "Z"


SLEEPERS = """
import os
import time
from functools import partial
from joblib import Parallel, delayed, parallel_config
from coverdrive.simulation.studies.orphans import end_with_parent

with parallel_config("loky", initializer=partial(end_with_parent, os.getpid())):
    rows = Parallel(n_jobs=2, return_as="generator_unordered")(delayed(time.sleep)(each) for each in (0, 0, 60, 60))
    for _ in rows:
        print("one", flush=True)
"""
"""two workers in the middle of something long"""

STUDY = [str(Path(__file__).with_name("run_fake_study.py"))]
FOREVER = ["100000", "0", "2"]


def end(command: list[str], lines: int, number: signal.Signals) -> list[int]:
    """End a process after some lines; what it started and is still there after a while is killed, and given back."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as started:
        assert started.stdout is not None
        for _ in range(lines):
            assert started.stdout.readline()
        processes = descendants(started.pid)
        assert len(processes) >= 2
        os.kill(started.pid, number)
        begin = time.monotonic()
        while any(map(alive, processes)) and time.monotonic() - begin < PATIENCE:
            time.sleep(0.1)
        left = [each for each in processes if alive(each)]
        for each in left:
            os.kill(each, signal.SIGKILL)
    return left


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "terminated"])
def test_no_worker_is_left(number: signal.Signals) -> None:
    assert not end([sys.executable, "-c", SLEEPERS], 2, number)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "terminated"])
def test_no_worker_of_a_study_is_left(number: signal.Signals, tmp_path: Path) -> None:
    assert not end([sys.executable, *STUDY, str(tmp_path), *FOREVER], 4, number)
