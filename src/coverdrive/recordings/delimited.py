"""Reads columns of numbers from large text files block by block, in bounded memory, with precise errors."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.recording import Progress

BLOCK_BYTES = 2**25
"""Size of the blocks that are read at a time"""

SITE = "location"
"""The one column that may hold text"""


@dataclass(frozen=True)
class Layout:
    """How the lines of a file are to be read."""

    file: Path
    columns: tuple[str, ...]
    """names of all columns in the file's order, in lower case"""
    separator: str
    """a comma, or a blank for any run of white space"""
    header_lines: int
    """lines before the first row of data"""


def read_columns(
    layout: Layout,
    wanted: Sequence[str],
    site: str | None,
    repairs: Counter[str],
    progress: Progress | None,
) -> pl.DataFrame:
    """The wanted columns as float64, of the rows of one site.

    Args:
        layout: the file and its columns.
        wanted: names of columns that hold numbers.
        site: the value of the column ``location`` to keep, in any case; None if there is only one site.
        repairs: gains ``truncated rows`` when the last line is cut.
        progress: called with the fraction that is read.

    Raises:
        RecordingError: for a cell that is no number, for a file without rows, for a site that is not in the
            file, and for a file of several sites if none is chosen.

    """
    names = [*wanted, SITE] if SITE in layout.columns else list(wanted)
    chosen = None if site is None else site.strip().lower()
    sites: Counter[str] = Counter()
    kept: list[pl.DataFrame] = []
    row = layout.header_lines + 1
    size = layout.file.stat().st_size
    with layout.file.open("rb") as stream:
        for _ in range(layout.header_lines):
            stream.readline()
        for text in _blocks(stream, layout, repairs):
            block = _parse(text, layout, names, row)
            row += len(block)
            if SITE in names:
                sites.update(dict(block[SITE].value_counts().iter_rows()))
                wished = chosen or next(iter(sites), "")
                block = block.filter(pl.col(SITE) == wished).drop(SITE)
            if chosen or len(sites) <= 1:
                kept.append(block)
            if progress:
                progress(min(1.0, stream.tell() / size))
    _check_sites(layout, sites, chosen)
    if not sum(map(len, kept)):
        raise RecordingError(layout.file, "the file holds no rows of data; check that it was copied whole")
    return pl.concat(kept)


def _blocks(stream: BinaryIO, layout: Layout, repairs: Counter[str]) -> Iterator[bytes]:
    """Blocks of whole lines; a last line that is cut is left out and counted."""
    rest = b""
    while chunk := stream.read(BLOCK_BYTES):
        whole, newline, tail = chunk.rpartition(b"\n")
        if newline:
            yield rest + whole + newline
            rest = tail
        else:
            rest += chunk
    if rest.strip():
        fields = rest.split() if layout.separator == " " else rest.split(b",")
        if len(fields) == len(layout.columns):
            yield rest
        else:
            repairs["truncated rows"] += 1


def _parse(text: bytes, layout: Layout, names: list[str], row: int) -> pl.DataFrame:
    """The named columns of one block whose first line is line ``row`` of the file."""
    if layout.separator == " ":
        text = re.sub(rb"[ \t\r]*\n[ \t]*", b"\n", re.sub(rb"[ \t]+", b" ", text)).lstrip()
    _check_columns(text, layout, row)
    numbers = [name for name in names if name != SITE]
    try:
        block = _read_block(text, layout, names, as_text=False)
    except pl.exceptions.PolarsError:
        block = None
    if block is None or not all(block[name].is_finite().all(ignore_nulls=False) for name in numbers):
        cells = _read_block(text, layout, names, as_text=True)
        block = cells.with_columns(pl.col(numbers).str.strip_chars(' "').cast(pl.Float64, strict=False))
        _check_cells(cells, block, layout, numbers, row)
    return block.with_columns(pl.col(SITE).str.strip_chars().str.to_lowercase()) if SITE in names else block


def _read_block(text: bytes, layout: Layout, names: list[str], as_text: bool) -> pl.DataFrame:
    """The named columns; the numbers as they are written, or as float64."""
    kind = pl.String if as_text else pl.Float64
    types = {name: kind if name in names and name != SITE else pl.String for name in layout.columns}
    wanted = [layout.columns.index(name) for name in names]
    block = pl.read_csv(text, has_header=False, separator=layout.separator, schema=types, columns=wanted)
    return block.select(names)


def _check_columns(text: bytes, layout: Layout, row: int) -> None:
    """Refuse lines of another number of columns; quoted text may hold separators and is not checked."""
    separator, expected = layout.separator.encode(), len(layout.columns) - 1
    lines = text.count(b"\n") + (not text.endswith(b"\n"))
    if text.count(separator) == lines * expected or b'"' in text:
        return
    for index, line in enumerate(text.split(b"\n")):
        found = line.count(separator)
        if line.strip() and found != expected:
            raise RecordingError(
                layout.file,
                f"the line has {found + 1} columns, expected {expected + 1}; put the line right or remove it",
                row + index,
            )


def _check_cells(cells: pl.DataFrame, block: pl.DataFrame, layout: Layout, numbers: list[str], row: int) -> None:
    """Refuse cells that are no finite numbers."""
    for name in numbers:
        wrong = ~block[name].is_finite().fill_null(False)
        if wrong.any():
            index = int(wrong.arg_max() or 0)
            cell = cells[name][index]
            found = repr(cell) if cell else "an empty cell"
            raise RecordingError(
                layout.file,
                f"expected a number, got {found}; put the cell right or remove the row",
                row + index,
                name,
            )


def _check_sites(layout: Layout, sites: Counter[str], chosen: str | None) -> None:
    """Refuse a choice that the file does not offer, and a file of several sites without a choice."""
    held = ", ".join(f"{name} ({rows} rows)" for name, rows in sorted(sites.items()))
    if chosen and SITE not in layout.columns:
        raise RecordingError(
            layout.file, f"the file has no column Location to choose {chosen!r} by; leave the location out"
        )
    if chosen and sites and chosen not in sites:
        raise RecordingError(layout.file, f"no rows of the location {chosen!r}; the file has {held}")
    if not chosen and len(sites) > 1:
        raise RecordingError(layout.file, f"several locations in one file, choose one of {held}")
