"""Columns of recorded tracks as any file holds them, CSV or Parquet, and what has to hold for all of them.

Names are compared in lower case and with ``_`` for ``-``. Every table gets the column `ROW`, where in the file a row is
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import LARGEST, LARGEST_WHOLE, LENGTHS, WIDTHS, wrong_usual_sizes
from coverdrive.recordings.files.delimited import ROW, TEXTS, csv_layout, normalised, read_columns

LENGTH, WIDTH = 4.5, 1.8
"""[m] of a car, where the file does not tell"""

MOST_ODD_SIZES = 0.05
"""Share of the rows whose length or width may be no vehicle's; more show another unit"""

MOST_EQUAL, CELLS = 20_000_000, 8
"""Cells of a Parquet file that are read in any case, and for each of its bytes; tracks have less than one"""

WHOLE = ("vehicle", "frame", "lane")
"""Columns of whole numbers"""


def columns_of(file: Path) -> tuple[str, ...]:
    """The normalised names of the columns of a CSV or Parquet file, in its order."""
    if file.suffix.lower() != ".parquet":
        return csv_layout(file).columns
    with file.open("rb") as stream:
        return tuple(map(normalised, pl.read_parquet_schema(stream)))


def read_table(file: Path, wanted: Sequence[str], repairs: Counter[str], optional: Sequence[str] = ()) -> pl.DataFrame:
    """The wanted columns of a CSV or Parquet file, and the optional ones that it has, by their normalised names.

    All are float64, but for those in `delimited.TEXTS`. ``repairs`` gains ``truncated rows`` and ``blank lines``.
    """
    found = columns_of(file)
    for name in wanted:
        if name not in found:
            raise RecordingError(file, f"the file has no column {name}; expected {', '.join(wanted)}", 1)
    names = [*wanted, *(name for name in optional if name in found)]
    if file.suffix.lower() != ".parquet":
        return read_columns(csv_layout(file), names, None, repairs)
    return parquet_numbers(file, dict(zip(names, names, strict=True)))


def parquet_numbers(file: Path, names: dict[str, str]) -> pl.DataFrame:
    """Columns of a Parquet file by their new names: finite numbers below 2⁵³, or texts."""
    source = whole_parquet(file)
    spelled = {name: name for name in source.columns} | {normalised(name): name for name in source.columns}
    columns: dict[str, pl.Series] = {}
    for name, new in names.items():
        if name not in spelled:
            raise RecordingError(file, f"the file has no column {name}; expected {', '.join(names)}")
        values = source[spelled[name]]
        if name in TEXTS:
            columns[new] = _texts(file, values)
            continue
        if not values.dtype.is_numeric():
            raise RecordingError(file, f"expected numbers, got {values.dtype}; convert them", None, name)
        number = values.cast(pl.Float64)
        for row in (~(number.abs() < LARGEST).fill_null(False) | number.is_nan()).arg_true():
            raise RecordingError(file, f"expected a number, got {values[row]!r}; remove the row", row + 1, name)
        columns[new] = number
    if source.is_empty():
        raise RecordingError(file, "the file holds no rows of data; check that it was copied whole")
    return pl.DataFrame(columns).with_row_index(ROW, 1)


def whole_parquet(file: Path) -> pl.DataFrame:
    """All of a Parquet file, unless it holds more than its size can tell: equal values take no room in it."""
    content = file.read_bytes()  # polars would take brackets and stars in a path for a pattern
    columns = len(pl.read_parquet_schema(content))
    rows = int(pl.scan_parquet(content).select(pl.len()).collect().item())
    if rows * columns <= max(MOST_EQUAL, CELLS * len(content)):
        return pl.read_parquet(content)
    problem = f"{rows:,} rows of {columns} columns in {len(content):,} bytes are the same few again and again"
    raise RecordingError(file, f"{problem}; expected tracks, check how the file was made")


def _texts(file: Path, values: pl.Series) -> pl.Series:
    """A column of words as words are compared."""
    if not (values.dtype.is_numeric() or isinstance(values.dtype, pl.String | pl.Categorical | pl.Enum | pl.Null)):
        raise RecordingError(file, f"expected text, got {values.dtype}; convert it", None, values.name)
    return values.cast(pl.String).fill_null("").str.strip_chars().str.to_lowercase()


def _check_whole(file: Path, table: pl.DataFrame) -> None:
    """Refuse numbers of vehicles, frames and lanes that are not whole or not exact, and vehicles below 0."""
    for name in (name for name in WHOLE if name in table.columns):
        number = table[name]
        inexact = number.cast(pl.Float64).abs() >= (LARGEST if number.dtype.is_float() else LARGEST_WHOLE)
        for row in (inexact | (number != number.round()) | ((number < 0) & (name == "vehicle"))).arg_true():
            what = "an exact whole number, give it a smaller one" if inexact[row] else "a whole number"
            problem = f"expected {what}, got {number[row]}; put the cell right or remove the row"
            raise RecordingError(file, problem, table[ROW][row], name)


def plausible_rows(file: Path, table: pl.DataFrame, repairs: Counter[str]) -> pl.DataFrame:
    """With the usual size of the same vehicle, or of a car, where the file states one that no vehicle has.

    Numbers that are not whole are refused. ``repairs`` gains ``odd lengths`` and ``odd widths``.
    """
    _check_whole(file, table)
    for name, problem in wrong_usual_sizes(table["length"].to_numpy(), table["width"].to_numpy()):
        raise RecordingError(file, problem, None, name)
    for name, (least, most), usual in (("length", LENGTHS, LENGTH), ("width", WIDTHS, WIDTH)):
        good = pl.col(name).is_between(least, most)
        odd = table.select(ROW, name).filter(~good)
        if len(odd) > MOST_ODD_SIZES * len(table):
            problem = f"expected {least:g} to {most:g} m in most rows, got {odd[name][0]:g} m; check the unit"
            raise RecordingError(file, problem, odd[ROW][0], name)
        if len(odd):
            repairs[f"odd {name}s"] += len(odd)
            own = pl.when(good).then(pl.col(name)).median().over("vehicle").fill_null(usual)
            table = table.with_columns(pl.when(good).then(pl.col(name)).otherwise(own).alias(name))
    return table
