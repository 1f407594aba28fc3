"""Names of files."""

import errno
import math
import os
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.files import number_in_name, write_stream, write_text


@pytest.mark.parametrize(("value", "name"), [(0.5, "0.5"), (1.0, "1"), (2, "2"), (0.1, "0.1"), (0.75, "0.75")])
def test_names_by_hand(value: float, name: str) -> None:
    assert number_in_name(value) == name


@given(st.floats(0, 1e6), st.floats(0, 1e6))
def test_two_numbers_have_two_names(first: float, second: float) -> None:
    assert (number_in_name(first) == number_in_name(second)) == (first == second)


def test_neighbours_have_two_names() -> None:
    assert number_in_name(0.5) != number_in_name(math.nextafter(0.5, 1))


def test_names_may_be_any_bytes(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"b\xfctes")
    write_stream(folder / "table.csv", pl.DataFrame({"number": [1]}).write_csv)
    write_text(folder / "page.html", folder.name)
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == {
        "table.csv": b"number\n1\n",
        "page.html": b"b?tes",
    }


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a disk that is always full")
def test_a_full_disk_is_told_with_the_file_and_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "write_bytes", lambda *_: full.write(b"x" * 10**6))
    with Path("/dev/full").open("wb", buffering=0) as full, pytest.raises(OSError) as raised:
        write_stream(tmp_path / "table.csv", pl.DataFrame({"number": [1]}).write_csv)
    assert (raised.value.errno, raised.value.filename) == (errno.ENOSPC, str(tmp_path / "table.csv"))
    assert not list(tmp_path.iterdir())
