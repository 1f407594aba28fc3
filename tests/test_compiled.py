"""Code that is kept on the disk: read where nothing can be written, too."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from coverdrive import compiled as module

SOURCE = """
from coverdrive.compiled import compiled

@compiled
def twice(value):
    return 2 * value
"""


PARTS = """
from coverdrive.compiled import compiled

@compiled
def twice(value):
    return 2 * value

@compiled
def four_times(value):
    return twice(twice(value))
"""


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for code, and a module with a function to compile beside it."""
    (tmp_path / "sources").mkdir()
    (tmp_path / "sources" / "doubling.py").write_text(SOURCE)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


def loaded(kept: Path) -> ModuleType:
    """The module as a new process sees it."""
    module._folder.cache_clear()
    specification = importlib.util.spec_from_file_location("doubling", kept.parent / "sources" / "doubling.py")
    assert specification is not None and specification.loader is not None
    made = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(made)
    return made


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def nothing_can_be_written(monkeypatch: pytest.MonkeyPatch, kept: Path) -> None:
    usual = os.access

    def access(path: Path, mode: int) -> bool:
        return not (mode & os.W_OK and kept in Path(path).parents) and usual(path, mode)

    monkeypatch.setattr(os, "access", access)


def test_code_that_was_kept_is_read_where_nothing_can_be_written(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = loaded(kept)
    assert first.twice(2) == 4 and sum(first.twice.stats.cache_misses.values()) == 1
    before = contents(kept)
    assert len(before) == 2
    nothing_can_be_written(monkeypatch, kept)
    again = loaded(kept)
    assert again.twice(3) == 6
    assert sum(again.twice.stats.cache_hits.values()) == 1 and not again.twice.stats.cache_misses
    assert again.twice(1.5) == 3.0  # of another type: compiled now, and not kept there
    assert contents(kept) == before


def test_without_kept_code_and_without_a_place_it_is_compiled(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept.touch()  # no folder can be made in a file
    assert loaded(kept).twice(2) == 4


def test_other_sources_are_compiled_anew(kept: Path) -> None:
    loaded(kept).twice(2)
    (kept.parent / "sources" / "helper.py").write_text("changed = True")
    again = loaded(kept)
    assert again.twice(2) == 4 and sum(again.twice.stats.cache_misses.values()) == 1


def test_code_in_a_room_depends_on_all_of_its_hall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("hall/one", "hall/other", "elsewhere"):
        (tmp_path / room).mkdir(parents=True)
    monkeypatch.setattr(module, "__file__", str(tmp_path / "compiled.py"))
    named = module._fingerprint(tmp_path / "hall" / "one")
    (tmp_path / "elsewhere" / "apart.py").write_text("apart = 1")
    assert module._fingerprint(tmp_path / "hall" / "one") == named
    (tmp_path / "hall" / "other" / "called.py").write_text("called = 1")
    assert module._fingerprint(tmp_path / "hall" / "one") != named


def test_code_that_other_code_calls_is_compiled_but_as_a_part_of_it(kept: Path) -> None:
    (kept.parent / "sources" / "doubling.py").write_text(PARTS)
    made = loaded(kept)
    assert made.four_times(2) == 8
    assert made.four_times.signatures and not made.twice.signatures
    assert [file.name.split("-")[0] for file in kept.rglob("*.nbc")] == ["doubling.four_times"]
    assert made.twice(1.5) == 3.0  # of Python's own call it becomes a whole, too
    assert loaded(kept).four_times(3) == 12


def test_with_another_numba_it_is_compiled_as_that_does_it(tmp_path: Path) -> None:
    """In a process of its own, in which Numba calls itself a later version."""
    (tmp_path / "later.py").write_text(f"""
import numba
numba.__version__ = "0.99.0"
{PARTS}
from typing import NamedTuple
import numpy as np
from coverdrive.compiled import lent

@lent
class Given(NamedTuple):
    values: np.ndarray

@compiled
def doubled(given):
    return four_times(given.values[1]) / 2

assert doubled(Given(np.arange(3.0))) == 2.0 and four_times(2) == 8
assert type(four_times).__module__.startswith("numba.")
print(doubled.stats.cache_path)
""")
    ran = [
        subprocess.run(
            [sys.executable, tmp_path / "later.py"],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}, capture_output=True, text=True, check=True,
        )
        for _ in range(2)
    ]  # fmt: skip
    assert str(tmp_path / "kept") in ran[0].stdout and ran[1].stdout == ran[0].stdout


def test_code_is_there_once_it_was_compiled_by_whatever_process(kept: Path) -> None:
    first = loaded(kept)
    assert not module.is_there(first.twice)
    first.twice(2)
    assert module.is_there(first.twice) and module.is_there(loaded(kept).twice)


def test_of_several_processes_one_compiles(kept: Path) -> None:
    script = (
        f"import sys; sys.path.insert(0, {str(kept.parent / 'sources')!r}); import doubling; doubling.twice(2); "
        "print(sum(doubling.twice.stats.cache_misses.values()))"
    )
    processes = [subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert sorted(process.communicate(timeout=300)[0].strip() for process in processes) == ["0", "1"]
