"""Small NGSIM files of known content."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import polars as pl
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from recordings_fakes import TEXT_COLUMNS, ngsim_table


@pytest.fixture
def lines_run() -> Callable[[Callable[[], object]], int]:
    """A function that counts the lines of Python that a call runs, in whatever file: its time without a clock.

    The call is made once before, as a first one may import and compile.
    """

    def count(call: Callable[[], object]) -> int:
        call()
        lines, before = 0, sys.gettrace()

        def traced(_: FrameType, event: str, __: Any) -> Any:
            nonlocal lines
            lines += event == "line"
            return traced

        sys.settrace(traced)
        try:
            call()
        finally:
            sys.settrace(before)
        return lines

    return count


@pytest.fixture
def make_ngsim() -> Callable[..., pl.DataFrame]:
    return ngsim_table


@pytest.fixture
def write_csv(tmp_path: Path) -> Callable[[pl.DataFrame], Path]:
    def write(table: pl.DataFrame, name: str = "traffic.csv") -> Path:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        table.write_csv(tmp_path / name)
        return tmp_path / name

    return write


@pytest.fixture
def write_text(tmp_path: Path) -> Callable[[pl.DataFrame], Path]:
    def write(table: pl.DataFrame, name: str = "traffic.txt") -> Path:
        lines = ["".join(f"{value or 0!s:>15}" for value in row) for row in table.select(TEXT_COLUMNS).iter_rows()]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return tmp_path / name

    return write
