"""One command from the files of every format to a certified predictor, drives and the page, without a converter."""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from published_commonroad import write_commonroad
from published_formats import (
    Truth,
    truth,
    write_exid,
    write_highd,
    write_i24,
    write_interaction,
    write_lanelets,
    write_mona,
    write_tgsim,
)
from published_i80 import i80, write_i80
from published_ngsim import write_ngsim

import coverdrive as cd
from command import coverdrive
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.formats.registry import readers
from coverdrive.reporting import report
from coverdrive.results import Results
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.roads.places import recorded_place

SECONDS, SCENES = 5.0, 3
"""Of a recording, and the number of them: to train, to calibrate and to test"""

QUICK = ("prediction.boxes.most_steps=4", "prediction.boxes.members=1", "prediction.segments.stride=0.5")
"""A network that has hardly learned anything, whose sets are certified all the same"""

Written = list[str | Path]


@cache
def recorded(dt: float) -> list[Truth]:
    """Both carriageways, scene by scene; each numbers its vehicles anew."""
    tables = truth(dt, 2 * SCENES, SECONDS).tables
    pairs = zip(tables[::2], tables[1::2], strict=True)
    firsts = [(pair, pl.col("vehicle") - pair[0]["vehicle"].min()) for pair in pairs]
    return [Truth(tuple(table.with_columns(anew) for table in pair), dt) for pair, anew in firsts]


def each(write: Callable[[Path, Truth], Path], dt: float = 0.1, carriageways: int = 1) -> Callable[[Path], Written]:
    """Files of one name in folders of their own, as several sites or days are published."""

    def written(folder: Path) -> Written:
        paths: Written = []
        for number, real in enumerate(recorded(dt)):
            (folder / f"site {number}").mkdir()
            paths.append(write(folder / f"site {number}", Truth(real.tables[:carriageways], real.dt)))
        return paths

    return written


def tgsim(folder: Path) -> Written:
    return [write_tgsim(folder, recorded(0.1))]


def own(folder: Path) -> Written:
    settings = GeneratedSettings(scenes=SCENES, duration=SECONDS, vehicles=(18, 24))
    write_parquet(generate(settings), folder / "own.parquet")
    return [folder / "own.parquet"]


def exid(folder: Path) -> Written:
    return [*each(write_exid, 0.04)(folder), "--map", write_lanelets(folder)]


FORMATS: dict[str, Callable[[Path], Written]] = {
    "NGSIM": each(write_ngsim),
    "NGSIM-metric": each(lambda folder, real: write_ngsim(folder, real, "parquet")),
    "highD": each(write_highd, 0.04, carriageways=2),
    "exiD": exid,
    "INTERACTION": each(write_interaction),
    "MONA": each(write_mona, 0.04),
    "TGSIM": tgsim,
    "I-24": each(write_i24, 0.04),
    "CommonRoad 2018b": each(lambda folder, real: write_commonroad(folder, real, "2018b")),
    "CommonRoad 2020a": each(write_commonroad, carriageways=2),
    "own": own,
}


def test_no_format_is_forgotten():
    assert {name.split(" ")[0] for name in FORMATS} == set(readers()) - {"CitySim"}  # which is refused


def command(paths: Written, out: Path, *others: str) -> dict[str, Any]:
    """What the command finds with the quickest settings that drive."""
    claim = ("--unit", "window", "--confidence", "0.9", "--vehicles", "3", "--workers", "1")
    how = ("--out", out, "--set", *QUICK, "episode.duration=0.5")
    arguments = ("--recording", *paths, *claim, *(others or ("--trials", "1")), *how)
    return json.loads(coverdrive("run", *arguments, "--json", only="stdout"))


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without figures and videos, which ask nothing of the format, but take most of the time."""
    for drawn in ("draw_figures", "animate_drive"):
        monkeypatch.setattr(report, drawn, lambda *_: None)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_one_command_drives_on_a_road_like_the_recorded_one(name: str, tmp_path: Path, undrawn: None):
    found = command(FORMATS[name](tmp_path), tmp_path / "out")
    (certificate, *_) = found["certificates"]
    assert 0 < certificate["epsilon"] < 1 and certificate["confidence"] == 0.9
    assert found["evaluation"]["windows"]["total"] > 50
    assert pl.read_parquet(tmp_path / "out" / "study" / "trials.parquet").height == 1
    assert re.match(r"Driven on a road like the recorded one: 3 (straight )?lanes of 3\.[5-7]", found["driven_on"])
    assert found["driven_on"] in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_beside_and_on_a_ramp_that_ends(tmp_path: Path, undrawn: None):
    """Among vehicles of I-80 as recorded, in lanes 5 and 6 and on the ramp; egos begin on it, too."""
    paths = list[Path]()
    for number in range(SCENES):
        (tmp_path / f"{number}").mkdir()
        table = i80(100.0, 9.0 * number).filter((pl.col("Vehicle_ID") > 500) & pl.col("Frame_ID").is_between(300, 700))
        paths.append(write_i80(tmp_path / f"{number}", table, "txt"))
    found = command([*paths], tmp_path / "out", "--traffic", "replay", "--trials", "8")
    assert found["evaluation"]["windows"]["total"] > 1000
    assert found["driven_on"].startswith("Driven on the recorded roads")
    study, begun = Results(tmp_path / "out").driven_study(recordings=paths), list[int]()
    for number in range(8):
        trace = study.trace(number)
        assert trace.road.has_lane(np.array([100.0, 300.0])).tolist() == [[True] * 3, [False, True, True]]
        assert np.isfinite(trace.scene.states).all() and trace.scene.lon[-1, 0] > trace.scene.lon[0, 0]
        begun.append(int(trace.road.lane_at(trace.scene.lon[0, 0], trace.scene.lat[0, 0])))
    assert set(begun) == {0, 1, 2}
    assert recorded_place(cd.read(paths[0])).initial.lanes == 2  # a road like it has no ramp


@pytest.mark.slow
def test_from_python_it_is_the_same_study(tmp_path: Path, undrawn: None):
    (path,) = own(tmp_path)
    command([path], tmp_path / "out")
    short = EpisodeSettings(duration=0.5)
    predictor, recordings = cd.Predictor.load(tmp_path / "out" / "predictor.safetensors"), cd.read(path)
    mine = cd.study(predictor, recordings=recordings, vehicles=(3,), episode=short, trials=1, folder=tmp_path / "mine")
    commanded = Results(tmp_path / "out").driven_study()
    assert mine.setup.description() == commanded.setup.description()
    assert np.array_equal(mine.trace(0).scene.states, commanded.trace(0).scene.states)
