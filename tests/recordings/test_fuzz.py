"""Files of every kind with random damage are read, or refused by a `CoverdriveError`; nothing else happens.

Bytes are damaged, or what the grammar of the file knows (`mutations`). What is read is as fast as the traffic that was
written, so that no other unit, rate or direction was taken for it; nothing takes long, or much memory.
The slow test tries 20,000, evenly over all readers, or as many as `COVERDRIVE_MUTATIONS` says; it takes about 10 min.
"""

import io
import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
import polars as pl
import pytest
from mutations import changed, damaged
from published_formats import (
    truth,
    write_exid,
    write_highd,
    write_i24,
    write_interaction,
    write_mona,
    write_tgsim,
)
from recordings_fakes import metric, ngsim_table, straight, traffic

from coverdrive.errors import CoverdriveError
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import SCHEMA

MUTATIONS = int(os.environ.get("COVERDRIVE_MUTATIONS", "20000"))
"""Of all readers together, in the slow test"""

LONGEST, MOST = 20.0, 5e8
"""[s] of processor time that a file may take, and bytes that the process may need beside what it holds already"""

PROCESS = Path("/proc/self")

UNTOLD = ("i24.json",)
"""Files without speeds: those of the positions may be any"""


def small_text() -> bytes:
    """The original NGSIM text of two vehicles."""
    table = ngsim_table(vehicles=3, seconds=2.0)
    rows = table.select(table.columns[:14] + table.columns[20:24]).iter_rows()
    return "".join("".join(f"{value or 0!s:>15}" for value in row) + "\n" for row in rows).encode()


def written(table: pl.DataFrame, heads: bytes | None = None) -> bytes:
    content = io.BytesIO()
    table.write_parquet(content, metadata=None if heads is None else {"coverdrive": heads.decode("utf-8", "replace")})
    return content.getvalue()


HEADS = json.dumps([{"name": "a", "dt": 0.1, "edges": [0.0, 3.6, 7.2, 10.8], "length": 500.0, "repairs": {}}]).encode()
OWN = traffic(vehicles=3, seconds=2.0).with_columns(recording=pl.lit(0, dtype=pl.Int64))
SEEDS: dict[str, bytes] = {
    "a.csv": ngsim_table(vehicles=3, seconds=2.0).write_csv().encode(),
    "a.txt": small_text(),
    "a.xml": straight().encode(),
    "metric.parquet": written(metric()),
    "own.parquet": written(OWN, HEADS),
}


def published() -> dict[str, dict[str, bytes]]:
    """Small files of public data sets by their names, each with those beside it."""
    real, fast = (truth(dt, carriageways=1, seconds=1.5) for dt in (0.1, 0.04))
    found: dict[str, dict[str, bytes]] = {}
    with TemporaryDirectory() as place:
        for write in (write_highd, write_exid, write_interaction, write_mona, write_i24):
            folder = Path(place) / write.__name__
            folder.mkdir()
            path = write(folder, fast if write is write_mona else real)
            beside = {other.name: other.read_bytes() for other in path.parent.iterdir() if other != path}
            found[path.name] = {path.name: path.read_bytes(), **beside}
        path = write_tgsim(Path(place), [real])
        found[path.name] = {path.name: path.read_bytes()}
    return found


PUBLISHED = published()
SEEDS |= {name: files[name] for name, files in PUBLISHED.items()}


def with_nasty_cells(table: pl.DataFrame, random: np.random.Generator) -> pl.DataFrame:
    """A cell, a column or a type replaced."""
    name = str(random.choice(table.columns))
    value = random.choice([0.0, -1.0, 1e9, 1e18, 1e300, np.nan, np.inf, -np.inf, 0.5, 3.6])
    match random.integers(5):
        case 0:
            return table.with_columns(pl.col(name).cast(random.choice([pl.Float32, pl.Int32, pl.String]), strict=False))
        case 1:
            return table.drop(name)
        case 2:
            return table.sample(
                fraction=random.uniform(0.0, 1.5), with_replacement=True, seed=int(random.integers(2**31))
            )
        case 3:
            return table.with_columns((pl.col(name) * value).cast(table[name].dtype, strict=False))
    row = int(random.integers(len(table)))
    cell = pl.when(pl.int_range(pl.len()) == row).then(pl.lit(value)).otherwise(pl.col(name))
    return table.with_columns(cell.cast(table[name].dtype, strict=False).alias(name))


def mutated(name: str, random: np.random.Generator) -> bytes:
    if name.endswith(".parquet") and random.random() < 0.6:
        table, heads = (OWN, HEADS) if name.startswith("own") else (metric(), None)
        if heads is not None and random.random() < 0.4:
            heads = damaged(heads, random)
        return written(with_nasty_cells(table, random), heads)
    return changed(name, SEEDS[name], random)


def put(name: str, folder: Path) -> Path:
    """The undamaged file, with those beside it."""
    for other, content in {name: SEEDS[name], **PUBLISHED.get(name, {})}.items():
        (folder / other).write_bytes(content)
    return folder / name


def most() -> int:
    """Bytes that this process has held at once, as Linux says it; 0 elsewhere."""
    if not PROCESS.exists():
        return 0
    status = dict(line.split(":") for line in (PROCESS / "status").read_text().splitlines())
    return int(status["VmHWM"].split()[0]) * 1024


def tried(name: str, count: int, folder: Path, seed: int) -> tuple[int, int]:
    """How many of ``count`` damaged files are read, and how many refused."""
    accepted, path = 0, put(name, folder)
    speeds = np.concatenate([each.table["speed"].to_numpy() for each in read([path])])
    if PROCESS.exists():
        (PROCESS / "clear_refs").write_text("5")  # the most is what it holds now
    begun = most()
    for number in range(count):
        path.write_bytes(mutated(name, np.random.default_rng([seed, number])))
        start = process_time()
        try:
            recordings = read([path])
        except CoverdriveError as error:
            assert name in str(error), (seed, number)  # the file is named
            assert len(str(error).encode()) < 20_000, (seed, number)
        except BaseException as error:
            error.add_note(f"mutation {number} of {name} with the seed {seed}")
            raise
        else:
            accepted += 1
            for recording in recordings:
                assert recording.table.select(SCHEMA.names()).schema == SCHEMA
                assert np.isfinite(recording.table.drop("stated", strict=False).to_numpy()).all(), (seed, number)
                speed = recording.table["speed"].median()
                told = 0.9 * speeds.min() - 0.5 <= speed <= 1.1 * speeds.max() + 0.5  # pyright: ignore[reportOperatorIssue]
                assert told or name in UNTOLD, (seed, number, speed)
        assert process_time() - start < LONGEST, (seed, number)
    assert most() - begun < MOST
    return accepted, count - accepted


@pytest.mark.parametrize("name", SEEDS)
def test_undamaged_files_are_read(name: str, tmp_path: Path):
    assert len(read([put(name, tmp_path)])) == 1


@pytest.mark.parametrize("name", SEEDS)
def test_damaged_files_are_read_or_refused(name: str, tmp_path: Path):
    accepted, refused = tried(name, 20, tmp_path, seed=1)
    assert accepted > 0 and refused > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
def test_many_damaged_files_are_read_or_refused(name: str, tmp_path: Path):
    accepted, refused = tried(name, MUTATIONS // len(SEEDS), tmp_path, seed=2)
    print(f"{name}: {accepted} read, {refused} refused")
