"""``coverdrive dial``: what it prints, and what uses it afterwards."""

import json
import shutil
from pathlib import Path

import pytest

from command import coverdrive
from coverdrive.errors import DataError
from coverdrive.reporting import report
from coverdrive.results import Results

pytestmark = pytest.mark.slow
ASKED = (
    "--traffic",
    "drivers",
    "--vehicles",
    "3",
    "--risk",
    "0.6",
    "--confidence",
    "0.8",
    "--pilot",
    "2",
    "--workers",
    "1",
)


@pytest.fixture(scope="module")
def ran(quick_fit: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of one run with quick settings, without figures and videos."""
    folder = tmp_path_factory.mktemp("run") / "out"
    with pytest.MonkeyPatch.context() as patch:
        for drawn in ("draw_figures", "animate_drive"):
            patch.setattr(report, drawn, lambda *_: None)
        coverdrive("run", "--config", quick_fit / "quick.toml", "--trials", "1", "--out", folder)
    return folder


@pytest.fixture(scope="module")
def dialled(ran: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """A folder with a study whose dial was turned, and what was printed."""
    folder = shutil.copytree(ran, tmp_path_factory.mktemp("dial") / "out")
    printed = coverdrive("dial", folder, *ASKED, "--scales", "0.5", "0.8", "--json", "--seed", "5", only="stdout")
    return folder, json.loads(printed)


def test_it_prints_what_scripts_ask_for(dialled: tuple[Path, dict]) -> None:
    folder, found = dialled
    assert found["scale"] in (0.5, 0.8) and found["reached"] is True
    assert found["risk"] <= 0.6 and found["confidence"] == 0.8 and found["collisions"] <= found["drives"]
    assert found["mean_speed"] > 10 and found["sentence"].startswith("With 80 % confidence at most")
    assert (folder / "dial-drivers" / "seed-5" / "frontier.csv").exists()


def test_what_was_proved_is_what_drives(dialled: tuple[Path, dict]) -> None:
    folder, found = dialled
    results = Results(folder)
    assert results.predictor.scale == results.experiment.prediction.scale == found["scale"]
    assert results.dialled is not None and results.dialled.sentence == found["sentence"]
    assert results.certified.driven[0].scale == found["scale"]
    assert (folder / "study@1").exists() and not (folder / "study").exists()
    assert results.scored is not None and results.fitted.predictor is results.predictor


def test_a_study_afterwards_says_what_was_proved_and_that_it_is_another(dialled: tuple[Path, dict]) -> None:
    folder, found = dialled
    printed = " ".join(coverdrive("study", folder, "--trials", "2").split())
    assert found["sentence"][:60] in printed
    assert "These drives are others than those that were proved" in printed and "traffic.kind" in printed
    coverdrive("report", folder)
    page = (folder / "report.html").read_text(encoding="utf-8")
    heading = page[page.index("<h1") : page.index("</h1>")]
    assert "drives like these touch anybody (" in heading and "These drives are others than those" in page


def test_a_risk_that_so_few_drives_cannot_prove_is_refused(dialled: tuple[Path, dict]) -> None:
    folder, _ = dialled
    said = coverdrive("dial", folder, *ASKED, "--most", "1", "--scales", "0.5", "0.9", status=2)
    assert "without any event would do" in " ".join(said.split())


def test_dialled_sets_that_were_edited_are_refused(dialled: tuple[Path, dict], tmp_path: Path) -> None:
    folder = shutil.copytree(dialled[0], tmp_path / "edited")
    file = folder / "dialled.json"
    file.write_text(file.read_text(encoding="utf-8").replace('"reached": true', '"reached": false'), encoding="utf-8")
    with pytest.raises(
        DataError, match=r"dialled\.json is not as it was written.* make it anew with `coverdrive dial`"
    ):
        _ = Results(folder).dialled


def test_dialled_sets_that_are_missing_are_dialled_again(dialled: tuple[Path, dict], tmp_path: Path) -> None:
    folder = shutil.copytree(dialled[0], tmp_path / "missing")
    (folder / "dialled.json").unlink()
    with pytest.raises(DataError, match=r"dialled\.json cannot be read .*; make it with `coverdrive dial`"):
        _ = Results(folder).dialled
    coverdrive("dial", folder, *ASKED, "--scales", "0.5", "0.8", "--seed", "5")
    found = Results(folder).dialled
    assert found is not None and found.scale == dialled[1]["scale"]


def test_a_planner_of_other_settings_is_dialled(ran: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(ran, tmp_path / "out")
    coverdrive("dial", folder, *ASKED, "--scales", "0.5", "--set", "planner.manners.like=paper", "--seed", "6")
    said = " ".join(coverdrive("study", folder, "--traffic", "drivers", "--vehicles", "3", "--trials", "1").split())
    assert "These drives are others than those that were proved" in said and "planner.manners.like" in said


def test_proofs_of_several_seeds_are_counted(ran: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(ran, tmp_path / "out")
    said = [coverdrive("dial", folder, *ASKED, "--scales", "0.5", "--seed", str(seed)) for seed in (6, 7)]
    assert "such proofs were begun" not in " ".join(said[0].split())
    assert "In this folder 2 such proofs were begun: each has that confidence alone" in " ".join(said[1].split())
    found = Results(folder).dialled
    assert found is not None and found.other_proofs == 1


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    said = " ".join(coverdrive("dial", "--help").split())
    assert "proved" in said and "--scales" in said and "--risk" in said


@pytest.mark.parametrize("option", ["--event own", "--scales 0.3 0.8", "--procedure Holm", "--most 5", "--beside idm"])
def test_what_says_how_drives_prove_is_refused_for_replays(quick_fit: Path, option: str) -> None:
    said = coverdrive("dial", quick_fit, "--traffic", "replay", *option.split(), status=2)
    assert f"{option.split()[0]} would have no effect, as replays prove nothing" in said
