"""The demo: what is stored is whole and of this version, and a page of it is written without a drive."""

import hashlib
import json
import re
import subprocess
import sys
import webbrowser
import zipfile
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command import coverdrive
from coverdrive.cli.demo import STORED, _unpack
from coverdrive.errors import DataError
from coverdrive.results import Results
from coverdrive.simulation.drives.storage import load_trace
from coverdrive.simulation.studies.setup import Setup

ROOT = Path(__file__).parents[2]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What would be shown in a browser, which is not there."""
    shown: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: bool(shown.append(address)))
    return shown


def shown(*arguments: str | Path) -> dict[str, Any]:
    return json.loads(coverdrive("demo", *arguments, "--json", only="stdout"))


def test_what_is_stored_is_small_certified_and_of_this_configuration(tmp_path: Path) -> None:
    assert STORED.stat().st_size <= 200_000
    with zipfile.ZipFile(STORED) as stored:
        stored.extractall(tmp_path)
    results = Results(tmp_path)
    assert results.predictor.certificate.sentence.startswith("With 99 % confidence")
    assert results.certified.certificates[0].epsilon <= 0.1
    study = results.study(results.experiment)
    study.files.claim(study.setup.description())  # else: python tools/demo_results.py
    assert study.trials.height == 40


def test_what_is_stored_solves_scenarios_and_needs_no_tracks_for_it(tmp_path: Path) -> None:
    with zipfile.ZipFile(STORED) as stored:
        stored.extractall(tmp_path)
    scenario = tmp_path / "USA_Test-1_1_T-1.xml"
    scenario.write_text("")
    Results(tmp_path).refuse_seen([scenario])
    with pytest.raises(DataError, match="is a demo, which does not keep what it was made from: to replay recordings"):
        Results(tmp_path).seen.refuse([])
    assert not Results(tmp_path).can_replay(())
    sealed = json.loads((tmp_path / "manifest.json").read_text())
    run = json.loads((tmp_path / "run.json").read_text())
    run["recordings"][0]["name"] = "mine"
    (tmp_path / "run.json").write_text(text := json.dumps(run))
    sealed["files"]["run.json"] = hashlib.sha256(text.encode()).hexdigest()
    (tmp_path / "manifest.json").write_text(json.dumps(sealed))
    with pytest.raises(DataError, match=r"seen\.parquet"):
        Results(tmp_path).refuse_seen([scenario])


def test_nothing_is_driven_for_the_page(tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Setup, "drive", lambda *_: pytest.fail("it was driven"))
    found = shown("--out", tmp_path / "demo")
    page = Path(found["report"])
    assert opened == [page.resolve().as_uri()]
    assert re.findall(r'id="replay-data-(\d+)"', page.read_text(encoding="utf-8")) == [str(found["trial"])]
    assert found["sentences"][0] in " ".join(unescape(page.read_text(encoding="utf-8")).split())


def test_it_says_where_the_drive_is_from(tmp_path: Path, opened: list[str]) -> None:
    printed = " ".join(coverdrive("demo", "--no-open", "--out", tmp_path).split())
    assert not opened
    assert "It was driven when the package was made" in printed and "of 20-s drives like these touch anybody" in printed


def test_a_dial_of_it_is_refused_before_it_drives(tmp_path: Path) -> None:
    """Scores of windows are not stored."""
    shown("--no-open", "--out", tmp_path)
    assert "scores.safetensors cannot be read" in coverdrive("dial", tmp_path, "--scales", "0.4", status=2)
    assert not [*tmp_path.glob("dial*")]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a disk that is always full")
def test_what_has_no_room_is_not_there_and_comes_with_the_next_call(tmp_path: Path) -> None:
    write = Path.write_bytes

    def filling(path: Path, content: bytes) -> int:
        return write(path if path.suffix == ".json" else Path("/dev/full"), content)

    with pytest.MonkeyPatch.context() as patch, zipfile.ZipFile(STORED) as stored:
        patch.setattr(Path, "write_bytes", filling)
        assert "No space left on device" in coverdrive("demo", "--no-open", "--out", tmp_path, status=2)
        found = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
        assert found == {name: stored.read(name) for name in ("manifest.json", "certificate.json")}
    _unpack(tmp_path)
    assert Results(tmp_path).predictor


def test_other_files_are_left_alone(tmp_path: Path, opened: list[str]) -> None:
    other = tmp_path / "config.toml"
    other.write_text("seed = 7\n")
    for place in (tmp_path, other):
        assert "holds something else" in coverdrive("demo", "--out", place, status=2)
    assert [other.read_text(), list(tmp_path.iterdir()), opened] == ["seed = 7\n", [other], []]


@pytest.mark.slow
def test_it_is_driven_again(tmp_path: Path) -> None:
    stored, driven = (shown("--no-open", "--out", tmp_path, *more) for more in ((), ("--drive",)))
    assert (stored["driven"], driven["driven"]) == (False, True)
    (file,) = (tmp_path / "study" / "traces").iterdir()
    with zipfile.ZipFile(STORED) as archive:
        archive.extract(f"study/traces/{file.name}", tmp_path / "stored")
    before, now = load_trace(tmp_path / "stored" / "study" / "traces" / file.name), load_trace(file)
    assert before.outcome.kind is now.outcome.kind
    assert np.abs(before.scene.lon[0] - now.scene.lon[0]).max() < 0.01
    assert not np.array_equal(before.scene.lon, now.scene.lon)  # the stored one is rounded


def test_the_wheel_holds_it(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="needs the extra test")
    build = f"from hatchling.build import build_wheel; print(build_wheel({str(tmp_path)!r}))"
    made = subprocess.run([sys.executable, "-c", build], cwd=ROOT, capture_output=True, text=True, check=True)
    with zipfile.ZipFile(tmp_path / made.stdout.split()[-1]) as wheel:
        assert wheel.read("coverdrive/cli/demo.zip") == STORED.read_bytes()
