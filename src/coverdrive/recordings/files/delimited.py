"""Reads columns of numbers from large text files block by block, in bounded memory, with precise errors."""

import csv
import re
from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.progress import done
from coverdrive.recordings.checks import LARGEST

BLOCK_BYTES = 2**25
"""Size of the blocks that are read at a time"""

LONGEST_LINE = 2**26
"""[bytes]"""

SITE = "location"
"""The column that tells the sites of a file apart"""

TEXTS = frozenset({SITE, "agent_type", "class", "upperlanemarkings", "lowerlanemarkings"})
"""The columns that hold text"""

ROW = "row"
"""The column that says on which line of the file, counted from 1, a row stands"""


_UTF_16 = "text in UTF-16; save it as UTF-8"
_BEGINS = {b"\xff\xfe": _UTF_16, b"\xfe\xff": _UTF_16, b"\x1f\x8b": "packed by gzip; unpack it",
           b"PK\x03\x04": "a ZIP archive or a workbook; unpack it, or save it as CSV"}  # fmt: skip
"""How files begin that are no text in UTF-8, and what they are"""


class Layout(NamedTuple):
    """How the lines of a file are to be read; the first one is a header if commas separate the cells."""

    file: Path
    columns: tuple[str, ...]
    """names of all columns in the file's order, in lower case"""
    separator: str
    """a comma, or a blank for any run of white space"""


def normalised(name: str) -> str:
    """A column's name as names are compared: in lower case, with ``_`` for ``-``."""
    return name.strip().strip('"').strip().lower().replace("-", "_")


def csv_layout(file: Path) -> Layout:
    """The normalised names of the columns in the header; none where the first line has no comma."""
    with file.open("rb") as stream:
        begin = stream.readline(100_000)
        first = begin.decode("utf-8", errors="replace").lstrip("\ufeff")
        if not first.strip() and stream.read(1000).strip():
            raise RecordingError(file, "the first line is blank; let the names of the columns be there", 1)
    for what in (_BEGINS[each] for each in _BEGINS if begin.startswith(each)):
        raise RecordingError(file, f"it is {what}")
    if "\r" in first.strip():
        raise RecordingError(file, "its lines end in carriage returns alone; save it with line feeds")
    if not first.strip():
        raise RecordingError(file, "the file is empty; check that it was copied whole")
    if ";" in first and "," not in first:
        raise RecordingError(
            file, "its columns are apart by semicolons; write it with commas, and points in numbers", 1
        )
    names = first.split(",") if "," in first else ()
    return Layout(file, tuple(map(normalised, names)), ",")


def read_columns(layout: Layout, wanted: Sequence[str], site: str | None, repairs: Counter[str]) -> pl.DataFrame:
    """The wanted columns as float64 (`TEXTS` as lower-case text), of the rows of one site, and the column `ROW`.

    ``site`` is the value of the column ``location`` to keep, in any case; None if there is only one. ``repairs`` gains
    ``truncated rows`` when the last line is cut, and ``blank lines``.
    """
    names = [*wanted, SITE] if SITE in layout.columns else list(wanted)
    for name in names:
        if layout.columns.count(name) > 1:
            raise RecordingError(layout.file, "the header names this column twice; remove one of them", 1, name)
    chosen = None if site is None else site.strip().lower()
    sites: Counter[str] = Counter()
    kept: list[pl.DataFrame] = []
    row = 1
    size = layout.file.stat().st_size
    with layout.file.open("rb") as stream:
        if layout.separator == ",":
            stream.readline()
            row = 2
        for text in _blocks(stream, layout, repairs):
            block = _parse(text, layout, names, row, repairs)
            row += text.count(b"\n")
            if SITE in names:
                sites.update(dict(block[SITE].value_counts().iter_rows()))
                wished = chosen or next(iter(sites), "")
                block = block.filter(pl.col(SITE) == wished).drop(SITE)
            if chosen or len(sites) <= 1:
                kept.append(block)
            done(min(stream.tell(), size), size)
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
        elif len(rest := rest + chunk) > LONGEST_LINE:
            problem = f"a line has more than {LONGEST_LINE} bytes; check that it is a text file"
            raise RecordingError(layout.file, problem)
    if rest.strip():
        fields = rest.split() if layout.separator == " " else rest.split(b",")
        if len(fields) == len(layout.columns):
            yield rest
        else:
            repairs["truncated rows"] += 1


def _parse(text: bytes, layout: Layout, names: list[str], row: int, repairs: Counter[str]) -> pl.DataFrame:
    """The named columns of one block whose first line is line ``row`` of the file."""
    numbers, text = [name for name in names if name not in TEXTS], text.removeprefix(BOM_UTF8)
    block = _fast(text, layout, names, row)
    if block is None or not all(block[name].is_finite().all(ignore_nulls=False) for name in numbers):
        block = _slow(text, layout, names, row, repairs)
    for name in numbers:
        for index in (block[name].abs() >= LARGEST).arg_true():
            problem = f"expected a number below 2⁵³, got {block[name][index]:g}; put the cell right or remove the row"
            raise RecordingError(layout.file, problem, block[ROW][index], name)
    texts = [name for name in names if name in TEXTS]
    return block.with_columns(pl.col(texts).fill_null("").str.strip_chars().str.to_lowercase()) if texts else block


def _fast(text: bytes, layout: Layout, names: list[str], row: int) -> pl.DataFrame | None:
    """The block as polars reads it; None where lines differ in their number of columns, or cells are no numbers."""
    if layout.separator == " ":
        text = re.sub(rb"[ \t\r]*\n[ \t]*", b"\n", re.sub(rb"[ \t]+", b" ", text)).lstrip()
    lines = text.count(b"\n") + (not text.endswith(b"\n"))
    if text.count(layout.separator.encode()) != lines * (len(layout.columns) - 1) or b'"' in text:
        return None
    wanted = [layout.columns.index(name) for name in names]
    numbers = {k for k in wanted if layout.columns[k] not in TEXTS}
    types = {str(k): pl.Float64 if k in numbers else pl.String for k in range(len(layout.columns))}
    try:
        block = pl.read_csv(
            text, has_header=False, separator=layout.separator, schema=types, columns=wanted, quote_char=None
        )
    except pl.exceptions.PolarsError:
        return None
    block = block.select(pl.col(str(k)).alias(name) for k, name in zip(wanted, names, strict=True))
    return block.with_row_index(ROW, row) if len(block) == lines else None


def _slow(text: bytes, layout: Layout, names: list[str], row: int, repairs: Counter[str]) -> pl.DataFrame:
    """The block line by line: blank lines are left out, cells may be quoted, and what is wrong is named."""
    lines = text.removesuffix(b"\n").decode("utf-8", errors="replace").replace("\0", "\ufffd").split("\n")
    cells: list[list[str]] = []
    rows: list[int] = []
    wanted = [layout.columns.index(name) for name in names]
    for number, line in enumerate(lines, start=row):
        if not line.strip():
            repairs["blank lines"] += 1
            continue
        found = line.split() if layout.separator == " " else _fields(layout.file, line, number)
        if len(found) != len(layout.columns):
            problem = f"the line has {len(found)} columns, expected {len(layout.columns)}; put it right or remove it"
            raise RecordingError(layout.file, problem, number)
        cells.append([found[k].strip() for k in wanted])
        rows.append(number)
    table = pl.DataFrame(cells, schema=dict.fromkeys(names, pl.String), orient="row")
    numbers = [name for name in names if name not in TEXTS]
    block = table.with_columns(pl.col(numbers).cast(pl.Float64, strict=False))
    for name in numbers:
        for index in (~block[name].is_finite().fill_null(False)).arg_true():
            found = repr(table[name][index]) if table[name][index] else "an empty cell"
            problem = f"expected a number, got {found}; put the cell right or remove the row"
            raise RecordingError(layout.file, problem, rows[index], name)
    return block.insert_column(0, pl.Series(ROW, rows, dtype=pl.get_index_type()))


def _fields(file: Path, line: str, row: int) -> list[str]:
    """The cells of a line that may be quoted."""
    if line.count('"') % 2:
        raise RecordingError(file, "a quoted cell has no end; close or remove the quotation mark", row)
    try:
        return next(csv.reader([line], skipinitialspace=True))
    except csv.Error as error:
        problem = f"the line cannot be cut into cells ({error}); put it right or remove it"
        raise RecordingError(file, problem, row) from None


def _check_sites(layout: Layout, sites: Counter[str], chosen: str | None) -> None:
    """Refuse a choice that the file does not offer, and a file of several sites without a choice."""
    held = ", ".join(f"{name} ({rows} rows)" for name, rows in sorted(sites.items()))
    if chosen and SITE not in layout.columns:
        problem = f"the file has no column Location to choose {chosen!r} by; leave the location out"
        raise RecordingError(layout.file, problem)
    if chosen and sites and chosen not in sites:
        raise RecordingError(layout.file, f"no rows of the location {chosen!r}; the file has {held}")
    if not chosen and len(sites) > 1:
        raise RecordingError(layout.file, f"several locations in one file, choose one of {held}")
