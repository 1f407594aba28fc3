"""A results folder is read back as it was written, or refused by the name of the file that is not."""

import json
import re
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from command import coverdrive
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import _METHODS, Method
from coverdrive.config import Experiment
from coverdrive.errors import DataError, SettingError
from coverdrive.league.table import SCHEMA as LEAGUE
from coverdrive.prediction.fits.calibrations import certify
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.results import Results
from coverdrive.simulation.roads.places import PLACES, Place

FILES = (
    "config.toml", "run.json", "predictor.safetensors", "scores.safetensors", "certificate.json", "learned.safetensors",
)  # fmt: skip


@pytest.fixture
def results(quick_fit: Path, tmp_path: Path) -> Results:
    """A copy of the folder of a quick fit."""
    return Results(shutil.copytree(quick_fit, tmp_path / "results"))


def read_all(results: Results) -> None:
    """Read every file of the fit."""
    assert results.fitted.predictor is results.predictor
    assert results.scored is not None
    assert results.methods == []


def test_what_was_saved_is_read_back(results: Results) -> None:
    read_all(results)
    certified, scored = results.certified, results.scored
    assert certified.certificates == (results.predictor.certificate,)
    assert evaluate(results.predictor.rule, scored.test) == replace(certified.evaluation, kinds={})
    assert sum(each.total for each in certified.evaluation.kinds.values()) == len(scored.test)
    assert len(scored.calibration) == certified.samples["calibration"]
    sentences = json.loads((results.folder / "certificate.json").read_text(encoding="utf-8"))["sentences"]
    assert sentences == [each.sentence for each in certified.certificates]


def test_methods_are_compared_on_the_scores_that_were_kept(results: Results) -> None:
    compared = certify(results, targets=(0.2,))
    results.save_methods(compared)
    kept = Results(results.folder).methods
    assert [(each.method, each.certificate, each.evaluation) for each in kept] == [
        (each.method, each.certificate, each.evaluation) for each in compared
    ]
    assert (results.folder / "methods.csv").exists()
    (results.folder / "methods.json").unlink()
    with pytest.raises(DataError, match=r"methods\.json cannot be read .*; make it with `coverdrive calibrations`"):
        _ = Results(results.folder).methods


def test_a_comparison_that_cannot_be_kept_leaves_the_one_before(results: Results, monkeypatch) -> None:
    monkeypatch.setitem(_METHODS, Method.SVM, _METHODS[Method.POST_BLOATING])  # takes longer than all others
    compared = certify(results, targets=(0.2,))
    results.save_methods(compared)
    with monkeypatch.context() as patch, pytest.raises(OSError, match="full"):
        patch.setattr("coverdrive.sealed.write_json", Mock(side_effect=OSError("the disk is full")))
        results.save_methods(certify(results, targets=(0.1,)))
    assert Results(results.folder).methods == compared


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "foreign", "gone"])
def test_a_damaged_file_is_refused_by_its_name(results: Results, name: str, damage: str) -> None:
    file = results.folder / name
    content = file.read_bytes()
    at = len(content) // 2
    wrong = {
        "flipped": content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :],
        "cut": content[:at],
        "empty": b"",
        "foreign": b"\x89PNG\r\n",
    }
    if damage == "gone":
        file.unlink()
    else:
        file.write_bytes(wrong[damage])
    with pytest.raises(DataError, match=name):
        read_all(Results(results.folder))


def test_an_edited_bound_is_refused(results: Results) -> None:
    file = results.folder / "certificate.json"
    edited = file.read_text(encoding="utf-8").replace('"epsilon": 0.1', '"epsilon": 0.0001')
    file.write_text(edited, encoding="utf-8")
    with pytest.raises(DataError, match=r"certificate.json is not as it was written"):
        Results(results.folder).certified  # noqa: B018


@pytest.mark.parametrize("manifest", ["", "[]", "{}", '{"format": 1, "files": {}}', "\x00"])
def test_a_manifest_of_another_kind_is_refused(results: Results, manifest: str) -> None:
    (results.folder / "manifest.json").write_text(manifest, encoding="utf-8")
    with pytest.raises(DataError, match=r"manifest.json"):
        read_all(Results(results.folder))


@pytest.mark.parametrize("content", ["{}", "[]", "null", "5", '{"methods": 5}', '{"folder": {}}', "", "\\x00"])
@pytest.mark.parametrize("name", [each for each in FILES if each != "config.toml"] + ["methods.json", "dialled.json"])
def test_a_file_of_another_content_is_refused_even_if_it_is_sealed(results: Results, name: str, content: str) -> None:
    (results.folder / name).write_text(content, encoding="utf-8")
    results._seal(name)
    with pytest.raises(DataError, match=name):
        read_all(Results(results.folder))


@pytest.mark.parametrize(
    "content",
    [b"", b"\x00", b"\xff\xfe", b"{}", b"entrant,world\n", b"a,b\n1,2\n", ",".join(LEAGUE).encode() + b"\nx,y\n"],
)
def test_a_damaged_table_of_the_league_is_refused(results: Results, content: bytes) -> None:
    file = results.folder / "league" / "league.csv"
    file.parent.mkdir()
    file.write_bytes(content)
    with pytest.raises(DataError, match=r"league.csv: not a readable result \(.*\); make it with `coverdrive league`"):
        results.league  # noqa: B018


@pytest.mark.parametrize("content", ["{}", '{"format": 2}', "[]", "null", '{"format": 2, "predictor": []}', "\x00"])
def test_a_damaged_description_of_a_study_is_refused(results: Results, content: str) -> None:
    file = results.folder / "study" / "study.json"
    file.parent.mkdir()
    file.write_text(content, encoding="utf-8")
    with pytest.raises(DataError, match="study"):
        results.driven_study()


@pytest.mark.slow
def test_a_page_without_a_study_leaves_none_behind(results: Results) -> None:
    written = json.loads(coverdrive("--json", "report", results.folder, only="stdout"))
    assert Path(written["report"]).exists() and not (results.folder / "study").exists()
    for called in (["animate"], ["report", "--trial", "0"], ["figures"]):
        said = coverdrive(called[0], results.folder, *called[1:], status=0 if called[0] == "figures" else 2)
        assert called[0] == "figures" or "there is no study in" in said
        assert not (results.folder / "study").exists()


def test_recordings_and_roads_that_are_not_replayed_are_refused(results: Results, tmp_path: Path) -> None:
    out, nowhere = (results.folder, "--trials", "1"), tmp_path / "nope"
    for called in (["study"], ["study", "--set", "planner.problem.obstacles.order=2,4"]):
        said = coverdrive(called[0], *out, *called[1:], "--recording", nowhere, status=2)
        assert "recordings are for replayed traffic only" in said and str(nowhere) in said
    said = coverdrive("study", *out, "--road", "curved", "--traffic", "replay", status=2)
    assert "on the road on which it was recorded, got the road 'curved'" in said
    said = coverdrive("study", *out, "--road", "curved", "--set", "traffic.kind=drivers,replay", status=2)
    assert "on the road on which it was recorded, got the road 'curved'" in said
    for called in (["rare", results.folder], ["drive", results.folder], ["dial", results.folder]):
        assert "recordings are for" in coverdrive(*called, "--recording", nowhere, status=2)
    assert not list(results.folder.glob("study*"))


@pytest.mark.slow
def test_a_new_fit_removes_what_shows_the_old_one(results: Results) -> None:
    results.save_methods(certify(results, targets=(0.2,)))
    gone = ["report.html", "report-drivers-curved.html", "figures/areas.pdf", "figures/drive_3.mp4", "methods.csv"]
    gone += ["figures-replay/areas.png", "dialled.json", "league/league.csv", "league/league.png"]
    kept = ["figures/notes.txt", "figures-of-mine/areas.png", "report-of-last-year.html", "study/study.json"]
    for name in (*gone, *kept):
        file = results.folder / name
        file.parent.mkdir(exist_ok=True)
        file.touch()
    coverdrive("fit", "--config", results.folder / "quick.toml", "--out", results.folder)
    assert Results(results.folder).methods == []
    assert [name for name in (*gone, *kept) if (results.folder / name).exists()] == kept
    assert not (results.folder / "figures-replay").exists()


def drove_with(results: Results, *names: str) -> None:
    """Folders of drives with the sets that there are."""
    for name in names:
        study = results.study(Experiment(), name=name)
        study.files.claim(study.setup.description())


def test_what_drove_with_other_sets_is_set_aside_under_names_that_are_free(results: Results) -> None:
    names = ("study", "study-drivers", "rare-drivers")
    for scale in (0.5, 0.7, 0.5):
        drove_with(results, *names)
        for name in ("league", "sweep"):
            (results.folder / name).mkdir(exist_ok=True)
        (results.folder / "report.html").touch()
        results._use_scale(scale)
        assert results.predictor.scale == results.experiment.prediction.scale == scale
        assert not (results.folder / "report.html").exists()
    aside = {each.name for each in results.folder.glob("*@*")}
    assert aside == {f"{name}@{scale}" for name in names for scale in ("1", "0.7")} | {
        f"{name}@{scale}" for name in ("league", "sweep") for scale in ("1", "0.7", "0.5")
    }
    assert all((results.folder / name / "study.json").exists() for name in names)  # of the same sets as before
    (results.folder / "study@0.5").mkdir()
    (results.folder / "rare-drivers@0.6").mkdir()
    (results.folder / "rare-drivers@0.6" / "study.json").write_text("of another version")
    results._use_scale(0.6)
    assert (results.folder / "study@0.5-2").exists()
    with pytest.raises(DataError, match="holds no finished study in `study-drivers`"):
        results.driven_study("drivers")
    assert not results.driven_study().files.exists  # whatever was set aside is not the only study
    drove_with(results, "study-drivers")
    assert results.driven_study().folder.name == "study-drivers"


@pytest.mark.parametrize("killed", ["predictor.safetensors", "manifest.json", "config.toml", "none"])
def test_a_dial_that_is_killed_while_it_writes_leaves_the_old_sets_or_the_new_ones(
    results: Results, monkeypatch: pytest.MonkeyPatch, killed: str
) -> None:
    """``killed`` before a file has its name: that of the new one, for those that are written together."""
    replace_file = Path.replace

    def replaced(file: Path, target: Path) -> Path:
        if target.name in (killed, f"next-{killed}" if killed.startswith("predictor") else ""):
            raise KeyboardInterrupt
        return replace_file(file, target)

    monkeypatch.setattr(Path, "replace", replaced)
    with pytest.raises(KeyboardInterrupt) if killed != "none" else nullcontext():
        results._use_scale(0.5)
    monkeypatch.undo()
    found = Results(results.folder)
    expected, asked = (0.5, 0.5) if killed in ("config.toml", "none") else (1.0, "auto")
    assert (found.experiment.prediction.scale, found.predictor.scale) == (asked, expected)
    assert found.certified.driven[0].scale == expected
    read_all(found)
    found._use_scale(0.5)
    assert Results(results.folder).predictor.scale == 0.5


@pytest.mark.parametrize("changed", [{}, {"traffic": {"kind": "drivers"}}, {"seed": 9}, {"study": {"trials": 7}}])
def test_a_new_fit_sets_aside_what_drove_with_other_settings(results: Results, changed: dict) -> None:
    drove_with(results, "study")
    experiment, predictor = results.experiment.updated(changed), results.predictor
    results._make_room(experiment, predictor, "paper")
    moved = changed.keys() & {"traffic", "seed"}
    assert (results.folder / "study@1").exists() == bool(moved) != (results.folder / "study").exists()
    (results.folder / "dial-drivers").mkdir()
    results._make_room(experiment, predictor.scaled(0.5), "paper")
    assert not (results.folder / "study").exists() and (results.folder / "dial-drivers").exists()
    results._make_room(
        experiment, replace(predictor, rule=replace(predictor.rule, tube=2 * predictor.rule.tube)), "paper"
    )
    assert (results.folder / "dial-drivers@1").exists()


def test_an_empty_folder_says_how_to_fill_it(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"no results in .*; make some with `coverdrive run --out"):
        Results(tmp_path).predictor  # noqa: B018


def test_a_study_is_driven_with_what_the_folder_holds_and_found_again(results: Results) -> None:
    experiment = results.experiment.updated({"seed": 9, "traffic": {"kind": "drivers"}, "study": {"vehicles": [2]}})
    study = results.study(experiment).run(1)
    assert study.folder == results.folder / "study-drivers"
    again = Results(results.folder).driven_study("drivers")
    assert again.setup.seed == 9 and list(again.setup.vehicles) == [2]
    assert again.setup.description() == study.setup.description()
    assert np.array_equal(again.trace(0).scene.states, study.trace(0).scene.states)
    with pytest.raises(DataError, match=r"--traffic mixed"):
        results.driven_study("mixed")


def test_the_only_study_is_found_without_its_name(results: Results) -> None:
    usual = results.experiment.updated({"study": {"vehicles": [2]}})
    results.study(usual.updated({"traffic": {"kind": "drivers"}})).run(1)
    assert results.driven_study().folder.name == "study-drivers"
    results.study(usual.updated({"traffic": {"kind": "mixed"}})).run(1)
    (results.folder / "study-drivers@0.5").mkdir()
    (results.folder / "study-drivers@0.5" / "study.json").touch()
    assert not results.driven_study().files.exists  # which of them?
    named = r"there is no study in .*study, but in study-drivers, study-mixed beside it: name one by --traffic"
    for called in (["animate"], ["report", "--trial", "0"], ["figures", "--trial", "0"]):
        assert re.search(named, coverdrive(called[0], results.folder, *called[1:], status=2))
    results.study(usual).run(1)
    assert results.driven_study().folder.name == "study"


def test_a_study_with_another_predictor_is_refused(results: Results) -> None:
    file = results.folder / "study" / "study.json"
    results.study(Experiment()).files.claim(results.study(Experiment()).setup.description() | {"predictor": "other"})
    assert file.exists()
    with pytest.raises(DataError, match="another predictor"):
        results.driven_study()


def test_roads_of_studies(quick_fit: Path, tmp_path: Path) -> None:
    """A fit remembers where it was recorded; studies on other roads have folders of their own."""
    experiment, like = Results(quick_fit).experiment, Place(wanted_speed=19.0)
    results = Results(shutil.copytree(quick_fit, tmp_path / "results"))
    assert results.place() == PLACES["paper"]
    assert results.study_name(None, "paper") == "study"
    assert results.study_name("drivers", "curved") == "study-drivers-curved"
    with pytest.raises(SettingError, match="a road like the recorded one needs recordings"):
        results.place("recorded")
    with pytest.raises(DataError, match=r"coverdrive study .* --road curved"):
        results.driven_study(road="curved")
    run = results.folder / "run.json"
    run.write_text(json.dumps({**results.run, "road": "recorded", "recorded_place": like.model_dump(mode="json")}))
    results._seal("run.json")
    assert results.place() == results.place("recorded") == like
    assert results.place("curved") == PLACES["curved"]
    assert (results.study_name(None, "recorded"), results.study_name(None, "paper")) == ("study", "study-paper")
    study = results.study(experiment.updated(like.parts))
    assert study.folder.name == "study" and study.setup.recorded == like.initial


def test_a_replay_of_nothing_but_what_trained_says_so(results: Results) -> None:
    experiment, seen = results.experiment, results.seen
    used = [each for each in experiment.recordings(()) if not seen.unseen([each])]
    write_parquet(used, results.folder / "used.parquet")
    replayed = results.study(experiment.updated({"traffic": {"kind": "replay"}}), [results.folder / "used.parquet"])
    with pytest.raises(DataError, match=f"nothing of the {len(used)} recordings is left to replay"):
        replayed.run(1)
    assert not replayed.folder.exists()
