"""What adversaries found in files of published formats: no traceback, no wrong traffic, no flood."""

import json
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from published_formats import truth, write_exid, write_highd, write_i24, write_mona
from recordings_fakes import driving, scenario, straight, three_lanes

from coverdrive.errors import RecordingError
from coverdrive.recordings.formats.i24 import read_i24
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.read import read
from coverdrive.recordings.tracks.smoothing import SmoothingSettings

FAST = truth(0.04, carriageways=1, seconds=3.0)


def listed(path: Path, what: str, change: Callable[[pl.DataFrame], pl.DataFrame]) -> Path:
    """The file of tracks, a description of which is changed."""
    description = path.with_name(path.name.replace("tracks", what))
    change(pl.read_csv(description)).write_csv(description)
    return path


def i24(folder: Path, change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]]) -> Path:
    """The file, its trajectories changed."""
    path = write_i24(folder, FAST)
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    return path


def each(**values: Callable[[Any], Any]) -> Callable[[list[dict[str, Any]]], list[dict[str, Any]]]:
    """Values of all trajectories changed."""
    return lambda records: [one | {name: change(one[name]) for name, change in values.items()} for one in records]


def metres(value: Any) -> Any:
    return [metres(part) for part in value] if isinstance(value, list) else 0.3048 * value


def later(times: list[float]) -> list[float]:
    return [time + 4e5 * (k > len(times) // 2) for k, time in enumerate(times)]


def contradicted(table: pl.DataFrame) -> pl.DataFrame:
    return pl.concat([table, table[:1].with_columns(drivingDirection=3 - pl.col("drivingDirection"))])


def as_bytes(table: pl.DataFrame, name: str) -> pl.DataFrame:
    return table.with_columns(pl.col(name).cast(pl.String).cast(pl.Binary))


def of_mona(folder: Path, name: str) -> Path:
    path = write_mona(folder, FAST, "parquet")
    as_bytes(pl.read_parquet(path), name).write_parquet(path)
    return path


def highd(**changes: pl.Expr) -> Callable[[Path], Path]:
    return lambda folder: write_highd(folder, FAST, **changes)


def at_rate(rate: float) -> Callable[[Path], Path]:
    return lambda folder: listed(
        write_highd(folder, FAST), "recordingMeta", lambda table: table.with_columns(frameRate=pl.lit(rate))
    )


WALKING = pl.lit("pedestrian").alias("class")
X, Y = pl.col("xVelocity"), pl.col("yVelocity")
REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "exiD with pedestrians only": (
        lambda folder: listed(
            write_exid(folder, FAST),
            "tracksMeta",
            lambda table: table.with_columns(pl.lit("pedestrian").alias("class")),
        ),
        "no vehicle",
    ),
    "MONA with binary numbers": (lambda folder: of_mona(folder, "x"), "column x: expected numbers, got Binary"),
    "MONA with binary words": (lambda folder: of_mona(folder, "agent_type"), "expected text, got Binary"),
    "highD at 30 Hz": (at_rate(30.0), r"of the speeds of the positions to the speeds that the file states is 1\.2;"),
    "highD at 20 Hz": (at_rate(20.0), r"states is 0\.8; expected 1"),
    "highD that stands": (highd(xVelocity=0 * X, yVelocity=0 * Y), "expected 1: check the units"),
    "highD that drives back": (highd(xVelocity=-X, yVelocity=-Y), "velocit"),
    "highD, contradicting directions": (
        lambda folder: listed(write_highd(folder, FAST), "tracksMeta", contradicted),
        r"01_tracksMeta\.csv.*vehicle \d+ is described twice, differently",
    ),
    "I-24 in metres": (
        lambda folder: i24(folder, each(x_position=metres, y_position=metres, length=metres, width=metres)),
        "feet",
    ),
    "I-24, times of 1e300": (
        lambda folder: i24(folder, each(timestamp=lambda times: [1e300 * time for time in times])),
        "y 1 is",
    ),
    "I-24, a length of 10^400": (lambda folder: i24(folder, each(length=lambda _: 10**400)), "y 1 is"),
    "I-24, a kind of 10^400": (
        lambda folder: i24(folder, each(coarse_vehicle_class=lambda _: 10**400)),
        "y 1 is",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str, tmp_path: Path):
    write, problem = REFUSED[case]
    with pytest.raises(RecordingError, match=problem):
        read([write(tmp_path)])


def test_an_equal_second_description_is_no_contradiction(tmp_path: Path):
    path = listed(write_highd(tmp_path, FAST), "tracksMeta", lambda table: pl.concat([table, table[:1]]))
    assert read([path])[0].repairs == {}


def test_trajectories_that_are_given_twice_are_left_out_and_counted(tmp_path: Path):
    (once,) = read([write_i24(tmp_path, FAST)])
    (found,) = read([i24(tmp_path, lambda records: records + records)])
    assert found.repairs == {"doubled vehicles": once.table["vehicle"].n_unique()}
    assert found.table["lon"].to_numpy() == pytest.approx(once.table["lon"].to_numpy())


def test_a_pause_of_days_takes_no_memory(tmp_path: Path):
    tracemalloc.start()
    (tracks,) = read_i24(i24(tmp_path, each(timestamp=later)), How(None, SmoothingSettings(), None))
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()
    assert len(tracks.table) < 2000


@pytest.mark.parametrize("encoding", ["ebcdic-cp-be", "no-such", "utf-7", "big5", "utf-16", "cp037", "base64"])
def test_encodings_that_no_parser_knows(encoding: str, tmp_path: Path):
    (tmp_path / "scene.xml").write_text(straight().replace('encoding="utf-8"', f'encoding="{encoding}"'))
    with pytest.raises(RecordingError, match=r"scene\.xml.*(not a CommonRoad file|commonroad-io cannot read it)"):
        read([tmp_path / "scene.xml"])


@pytest.mark.parametrize("encoding", ["iso-8859-1", "us-ascii", "utf-16"])
def test_encodings_that_parsers_know(encoding: str, tmp_path: Path):
    (tmp_path / "scene.xml").write_bytes(straight().replace("utf-8", encoding).encode(encoding))
    assert read([tmp_path / "scene.xml"])[0].repairs == {}


ONE = driving(100, 20.0, -1.75, 20.0, 40)
OBSTACLES: dict[str, tuple[str, str]] = {
    "a place of NaN": (re.sub(r"<x>[^<]*", "<x>NaN", ONE, count=1), "the position of obstacle 100 at time step 0 is"),
    **{
        f"no {part}": (re.sub(f"<{part}>.*?</{part}>", "", ONE, count=1), f"a dynamicObstacle has no {part}; expected")
        for part in ("time", "position", "orientation", "velocity")
    },
    "a speed of infinity": (re.sub(r"<velocity><exact>[^<]*", "<velocity><exact>inf", ONE, count=1), "the velocity of"),
    "a heading of NaN": (re.sub(r"<orientation><exact>[^<]*", "<orientation><exact>NaN", ONE, count=1), "orientation"),
    "a time of -5": (ONE.replace("<exact>0</exact>", "<exact>-5</exact>", 1), "time"),
    "a length of NaN": (ONE.replace("<length>4.6", "<length>NaN"), "the length of obstacle 100 is nan"),
    "a width of -2": (ONE.replace("<width>1.9", "<width>-2"), "the width of obstacle 100 is -2"),
    "a long number": (ONE.replace('id="100"', f'id="{10**400}"'), "commonroad|number|obstacle"),
}


@pytest.mark.parametrize("case", OBSTACLES)
def test_obstacles_that_are_none(case: str, tmp_path: Path):
    obstacle, problem = OBSTACLES[case]
    (tmp_path / "scene.xml").write_text(scenario(three_lanes(), obstacle))
    with pytest.raises(RecordingError, match=problem):
        read([tmp_path / "scene.xml"])
