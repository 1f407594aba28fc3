"""Scenarios with curves, ramps and merges are read, drawn, predicted and driven, or refused with a reason."""

import importlib.util
import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.road_table import on_road, table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.boxes.training import BoxSettings
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.fit import PredictionSettings, fit
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.reporting.figures.recording import road_figure

PROJECT = Path(__file__).parents[1]
KEPT = PROJECT / "benchmarks" / "results" / "roads.json"

Everything = dict[str, tuple[tuple[str, ...], Recording | None]]
"""Of every scenario its cells in the table, and the recording if it is not refused"""

pytestmark = [pytest.mark.real_data, pytest.mark.slow]


@pytest.fixture(scope="module")
def benchmark() -> Any:
    """`benchmarks/roads.py`."""
    spec = importlib.util.spec_from_file_location("roads", PROJECT / "benchmarks" / "roads.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PROJECT / "benchmarks")
        spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def predictor(us101: Path) -> BoxPredictor:
    """Of a quick fit to some of the US-101 scenes, which are none of the roads."""
    files = [us101 / "commonroad" / f"USA_US101-{scene}_1_T-1.xml" for scene in (3, 8, 11, 16, 17, 26)]
    settings = PredictionSettings(
        boxes=BoxSettings(most_steps=100),
        certificate=CertificateSettings(epsilon="auto", confidence=0.9, unit="window"),
    )
    made = fit(read(files), settings).predictor
    assert isinstance(made, BoxPredictor)
    return made


@pytest.fixture(scope="module")
def everything(roads: Path, benchmark: Any) -> Everything:
    return {file.stem: benchmark.read_cells(file) for file in sorted(roads.glob("*.xml"))}


@pytest.fixture(scope="module")
def recordings(everything: Everything) -> dict[str, Recording]:
    """Every scenario that is not refused."""
    found = {name: recording for name, (_, recording) in everything.items() if recording is not None}
    assert len(found) == 51
    return found


def test_the_table_in_the_documentation_is_what_is_read(everything: Everything, benchmark: Any):
    kept = json.loads(KEPT.read_text(encoding="utf-8"))["values"]["rows"]
    assert len(everything) == 54
    assert [row[: len(benchmark.READ)] for row in kept] == [list(cells) for cells, _ in everything.values()]


def test_every_road_is_drawn(recordings: dict[str, Recording]):
    for name, recording in recordings.items():
        picture = io.BytesIO()
        road_figure(recording).savefig(picture, format="png", dpi=60)
        assert len(picture.getvalue()) > 10_000, name


def test_everybody_is_predicted_everywhere(recordings: dict[str, Recording], predictor: BoxPredictor, benchmark: Any):
    for recording in recordings.values():
        assert benchmark.predicted(recording, predictor) >= 6 * recording.table["vehicle"].n_unique()


def outlines(recording: Recording, time: float) -> np.ndarray:
    """Points [m] in the road frame on the outlines of the real bodies, in the order of the scene."""
    moment = recording.table.filter((recording.table["time"] - time).abs() < recording.dt / 2)
    lon, lat, heading, length, width = (
        moment[name].to_numpy() for name in ("seen_lon", "seen_lat", "seen_heading", "length", "width")
    )
    side, end = np.linspace(-1, 1, 41), np.ones(41)
    along, across = np.concatenate([[side, end], [side, -end], [end, side], [-end, side]], axis=1)[:, :, None] / 2
    direction, (x, y) = recording.road.heading_to_map(lon, heading), recording.road.to_map(lon, lat)
    cosine, sine = np.cos(direction), np.sin(direction)
    along, across = along * length, across * width
    return np.stack(recording.road.to_road(x + along * cosine - across * sine, y + along * sine + across * cosine), -1)


def test_boxes_of_the_road_frame_hold_the_bodies_on_the_ground_as_the_planner_takes_them(
    recordings: dict[str, Recording],
):
    """A box in which a body stays as if the road were straight, as predicted and certified, and `on_road`."""
    sharp = 0
    for recording in recordings.values():
        road, times = recording.road, recording.table["time"].unique().sort()
        table, bent = table_of(road, ProblemSettings()), 0
        for time in times.to_list()[:: max(1, len(times) // 5)]:
            scene = recording.scene_at(time)
            half_sizes = turned_half_extents(scene.half_sizes, scene.heading)
            points, half_sizes = (np.repeat(each[:, None], 2, 1) for each in (scene.states[:, :2], half_sizes))
            straight = PredictedPaths(points, np.arange(scene.vehicles), half_sizes, 0.1)
            boxes = on_road(straight, float(scene.lon[0]), table).half_sizes[: len(straight), 0]
            apart = np.abs(outlines(recording, time) - points[:, 0])
            assert (apart <= boxes + 1e-6).all()
            bent += bool((apart > half_sizes[:, 0] + 1e-3).any())
        sharp += bent > 0
    assert sharp > 20  # where a box that knows nothing of the bend does not


def test_every_road_is_driven_in_replay(recordings: dict[str, Recording], predictor: BoxPredictor, benchmark: Any):
    for name, recording in recordings.items():
        (trace,) = benchmark.drives(recording, predictor, 1, 4.0)
        assert np.isfinite(trace.scene.states).all(), name
        assert trace.scene.lon[-1, 0] > trace.scene.lon[0, 0], name
        assert trace.road is recording.road


@pytest.fixture
def two_roads(roads: Path, tmp_path: Path) -> Iterator[Path]:
    """A folder with a scenario that is refused and one that is not."""
    for name in ("CHN_Cho-2_3_I-1-1", "ZAM_Zip-1_9_T-1"):
        (tmp_path / f"{name}.xml").symlink_to(roads / f"{name}.xml")
    yield tmp_path


def test_the_benchmark_runs(two_roads: Path, predictor: BoxPredictor, benchmark: Any, monkeypatch: pytest.MonkeyPatch):
    predictor.save(two_roads / "predictor.safetensors")
    out = two_roads / "roads.json"
    arguments = ("--predictor", str(two_roads / "predictor.safetensors"), "--drives", "1", "--duration", "2")
    monkeypatch.setattr(sys, "argv", ["roads", str(two_roads), *arguments, "--out", str(out)])
    benchmark.main()
    refused, driven = json.loads(out.read_text(encoding="utf-8"))
    assert refused["lanes"].startswith("refused: no vehicle is there")
    assert driven["driven"] == "2 s" and set(driven) == set(benchmark.COLUMNS)
