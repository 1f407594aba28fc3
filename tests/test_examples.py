"""Every example runs at a small size, with the predictor of the demo, and is as short as promised."""

import runpy
import sys
import zipfile
from pathlib import Path

import pytest

from coverdrive.cli.demo import STORED
from coverdrive.recordings.formats import reader as registry

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with what `coverdrive demo` leaves."""
    with zipfile.ZipFile(STORED) as stored:
        stored.extractall(tmp_path / "coverdrive-demo")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(example: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], *arguments: str) -> str:
    monkeypatch.setattr(sys, "argv", [example, *arguments])
    runpy.run_path(str(EXAMPLES / f"{example}.py"), run_name="__main__")
    return " ".join(capfd.readouterr().out.split())


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_is_short_and_says_how_to_call_it(example: Path) -> None:
    text = example.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    assert f"`python examples/{example.name}" in text.splitlines()[0]
    assert f"said({example.stem!r}".replace("'", '"') in Path(__file__).read_text(encoding="utf-8")


@pytest.mark.slow
def test_own_data(
    here: Path, hardly_trained: None, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(registry, "_readers", dict(registry._readers))
    assert "leaves its predicted set is at most" in said("own_data", monkeypatch, capfd, "--scenes", "9")
    assert len(list((here / "mine").glob("*.csv"))) == 9


@pytest.mark.slow
def test_own_planner(here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    table = said("own_planner_in_the_league", monkeypatch, capfd, "--trials", "2", "--duration", "2")
    assert "default" in table and "Careful" in table
    assert (here / "coverdrive-demo" / "league" / "league.csv").exists()


def test_highway_env(here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("highway_env", reason="needs the extra highway-env")
    assert "finished at 2.0 s" in said("driver_in_highway_env", monkeypatch, capfd, "--duration", "2")


def test_sumo(here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("libsumo", reason="needs the extra sumo", exc_type=ImportError)
    assert "finished at" in said("driver_in_sumo", monkeypatch, capfd, "--length", "200")


def test_commonroad(here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    for folder in ("driving", "recordings"):
        monkeypatch.syspath_prepend(Path(__file__).parent / folder)
    from problem_fakes import between, goal, written

    file = written(here, goal(between("velocity", 0, 40), first=10, last=15))
    assert "'solved': True" in said("commonroad_problem", monkeypatch, capfd, str(file))
    assert list((here / "solutions").glob("*.xml"))


def test_dial(here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    small = ("--risk", "0.5", "--confidence", "0.5", "--duration", "1")
    assert "1-s drives like these touch anybody" in said("dial_of_own_traffic", monkeypatch, capfd, *small)
