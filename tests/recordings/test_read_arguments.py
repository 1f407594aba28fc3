"""Arguments of `read` that no format uses, or that are of a wrong kind, are refused before anything is read."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from published_formats import truth, write_exid, write_highd, write_mona, write_tgsim
from recordings_fakes import metric, ngsim_table, straight, traffic

import coverdrive as cd
from coverdrive.config import Experiment
from coverdrive.errors import RecordingError, SettingError
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from shape_checks import unchecked

FAST, SLOW = truth(0.04, seconds=5.0), truth(0.1, carriageways=1, seconds=5.0)


def put(write: Callable[[Path], Any], name: str) -> Callable[[Path], Path]:
    def written(folder: Path) -> Path:
        write(folder / name)
        return folder / name

    return written


FILES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "NGSIM": (put(lambda path: ngsim_table().write_csv(path), "ngsim.csv"), "map"),
    "NGSIM-metric": (put(lambda path: metric().write_parquet(path), "metric.parquet"), "location map"),
    "highD": (lambda folder: write_highd(folder, FAST), "location map"),
    "exiD": (lambda folder: write_exid(folder, FAST), "location"),
    "MONA": (lambda folder: write_mona(folder, FAST), "location map"),
    "TGSIM": (lambda folder: write_tgsim(folder, [SLOW]), "location map"),
    "CommonRoad": (put(lambda path: path.write_text(straight()), "scene.xml"), "location map"),
    "own": (
        put(lambda path: write_parquet([Recording("own", traffic(), 0.1, Road.straight(), {})], path), "own.parquet"),
        "location map",
    ),
}
WHOSE = {
    "location": r"it holds one site; --location is for the formats NGSIM, this is {}: leave the location out",
    "map": r"where its tracks are on a map is not known; --map is for the formats INTERACTION, exiD, this is {}: leave",
}


@pytest.mark.parametrize(("name", "choice"), [(name, each) for name in FILES for each in FILES[name][1].split()])
def test_what_a_format_does_not_take_is_refused(name: str, choice: str, tmp_path: Path):
    with pytest.raises(RecordingError, match=WHOSE[choice].format(name)):
        given: dict[str, Any] = {choice: "us-101"}
        cd.read(FILES[name][0](tmp_path), **given)


def test_text_without_a_header_names_no_site(write_text: Callable[..., Path]):
    with pytest.raises(RecordingError, match="it holds one site; --location is for the formats NGSIM"):
        cd.read(write_text(ngsim_table()), location="us-101")


def test_one_file_that_takes_it_is_enough(tmp_path: Path):
    files = [FILES[name][0](tmp_path) for name in ("CommonRoad", "NGSIM")]
    assert [each.name for each in cd.read(files, location="us-101")] == ["scene", "ngsim"]


def test_settings_of_results_are_left_out_where_they_are_of_other_recordings(tmp_path: Path):
    scene, experiment = FILES["CommonRoad"][0](tmp_path), Experiment(location="us-101", map="lanelets.osm")
    assert [each.name for each in experiment.recordings([scene], stored=True)] == ["scene"]
    with pytest.raises(RecordingError, match="leave the location out"):
        experiment.recordings([scene])


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"paths": [["scene.xml"]]}, r"paths: expected a path, got \['scene\.xml'\]"),
        ({"paths": b"scene.xml"}, "paths: expected a path, got an object of bytes"),
        ({"paths": float("nan")}, "paths: expected a path, got nan"),
        ({"location": 5}, "location: expected a name, got 5"),
        ({"location": ["us-101"]}, r"location: expected a name, got \['us-101'\]"),
        ({"format": 5}, "format: expected a name, got 5"),
        ({"smoothing": 1.7}, "smoothing: expected SmoothingSettings, got 1.7"),
        ({"smoothing": {}}, "smoothing: expected SmoothingSettings, got {}"),
        ({"map": 5}, "map: expected a path, got 5"),
        ({"map": ["lanelets.osm"]}, r"map: expected a path, got \['lanelets\.osm'\]"),
        ({"dt": "0.1"}, "dt: expected a number, got '0.1'"),
        ({"dt": None}, "dt: expected a number, got None"),
        ({"dt": True}, "dt: expected a number, got True"),
        ({"dt": 10**400}, "dt: expected a number, got 1000"),
        ({"dt": float("nan")}, "dt: expected a number, got nan"),
        ({"dt": -0.1}, "the time step is -0.1 s; expected 0.02 to 1 s"),
    ],
)
def test_arguments_of_a_wrong_kind_are_named(arguments: dict[str, Any], complaint: str, tmp_path: Path):
    given: dict[str, Any] = {"paths": FILES["CommonRoad"][0](tmp_path)} | arguments
    with unchecked(), pytest.raises(SettingError, match=complaint):
        cd.read(**given)
