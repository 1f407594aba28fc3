"""Folders in which one process works at a time."""

import subprocess
import sys
from pathlib import Path

import pytest

from coverdrive.errors import DataError
from coverdrive.locks import alone

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs locks of Unix")

HOLD = (
    "import sys, time; from coverdrive.locks import alone\nwith alone(sys.argv[1]): print(flush=True); time.sleep(600)"
)


def test_whoever_comes_second_is_refused_until_the_first_has_ended(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    for _ in range(2):
        with alone(folder), alone(tmp_path), pytest.raises(DataError, match=r"writes to .*new; wait until .* folder$"):
            alone(folder).__enter__()
    with pytest.raises(ZeroDivisionError), alone(folder):
        raise ZeroDivisionError
    with alone(folder):
        pass
    assert not list(folder.iterdir())


def test_a_process_that_is_killed_holds_nothing(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        with pytest.raises(DataError), alone(tmp_path):
            pass
        process.kill()
    with alone(tmp_path):
        pass


def test_where_folders_cannot_be_held_everybody_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    with alone(tmp_path / "file" / "folder"), alone(None), alone(tmp_path):
        monkeypatch.setitem(sys.modules, "fcntl", None)
        with alone(tmp_path):
            pass
