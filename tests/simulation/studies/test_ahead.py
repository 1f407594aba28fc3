"""Compiling in a process of its own."""

import os
import time
from pathlib import Path

import pytest

from coverdrive.planning.solver import search
from coverdrive.simulation.studies import ahead
from coverdrive.simulation.studies.ahead import compiled_ahead

WAITING = "import os, time; open({file!r}, 'w').write(str(os.getpid())); time.sleep(600)"


def started(file: Path) -> int:
    """The number of the process, once it has written it."""
    end = time.monotonic() + 300
    while not (file.exists() and file.read_text()):
        assert time.monotonic() < end, "it never started"
        time.sleep(0.05)
    return int(file.read_text())


def gone(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a process that never comes to an end writes its number."""
    monkeypatch.setattr(search, "is_compiled", lambda: False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(ahead, "_CODE", WAITING.format(file=str(tmp_path / "number")))
    return tmp_path / "number"


def test_the_process_ends_with_the_block_whatever_it_came_to(file: Path) -> None:
    with pytest.raises(KeyboardInterrupt), compiled_ahead():
        process = started(file)
        assert not gone(process)
        raise KeyboardInterrupt
    assert gone(process)


def test_nothing_is_started_where_it_would_not_help(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ahead.subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    with compiled_ahead():
        pass
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(search, "is_compiled", lambda: True)
    with compiled_ahead():
        pass
