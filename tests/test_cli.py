"""The command from end to end, as a user calls it."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest
from rich.console import Console

from command import coverdrive, coverdrive_alone
from coverdrive import cli
from coverdrive.certificates.methods import Method
from coverdrive.cli import app
from coverdrive.config import Experiment
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.results import Results
from coverdrive.simulation.drivers.generated import generate
from coverdrive.simulation.drives.storage import load_trace


@pytest.fixture
def results(quick_run: Path, tmp_path: Path) -> Path:
    """A copy of the folder of one quick run, with its settings in ``quick.toml`` beside it."""
    return Path(shutil.copytree(quick_run, tmp_path / "run")) / "out"


@pytest.mark.slow
def test_run_prints_certificate_misses_sets_collisions_and_times(results: Path) -> None:
    printed = (results.parent / "printed.txt").read_text()
    for text in (
        "With 90 % confidence, the probability",
        "missed test windows",
        "set size",
        "frontal or side",
        "median",
    ):
        assert text in printed


@pytest.mark.slow
def test_run_writes_everything(results: Path) -> None:
    assert Experiment.load(results / "config.toml").seed == 3
    certificates = json.loads((results / "certificate.json").read_text())
    assert certificates["certificates"][0]["unit"] == "window"
    assert json.loads((results / "run.json").read_text())["recordings"][0]["fingerprint"]
    assert pl.read_parquet(results / "study" / "trials.parquet")["vehicles"].to_list() == [3, 4, 5, 6]
    assert json.loads((results / "methods.json").read_text())["methods"]
    assert pl.read_csv(results / "methods.csv")["method"].unique().sort().to_list() == sorted(Method)
    for name in ("affordance", "basis", "collisions", "methods", "planning", "scores", "snapshots"):
        assert (results / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (results / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    (video,) = (results / "figures").glob("drive_*.mp4")
    assert video.stat().st_size > 10_000
    html = (results / "report.html").read_text(encoding="utf-8")
    assert "With 90 % confidence" in html and "Every method of calibration on the same scores" in html


@pytest.mark.slow
def test_report_replays_named_trials(results: Path) -> None:
    found = json.loads(coverdrive("report", results, "--trial", "2", "--replays", "0", "--json", only="stdout"))
    assert found == {"report": str(results / "report.html")}
    html = (results / "report.html").read_text(encoding="utf-8")
    assert re.findall(r'id="replay-data-(\d+)"', html) == ["2"]
    stored = sorted((results / "study" / "traces").iterdir())
    coverdrive("report", results, "--trial", "2", "--replays", "0")
    assert sorted((results / "study" / "traces").iterdir()) == stored
    for command in ("report", "figures", "animate"):
        for trial, complaint in (("-1", "Must be >= 0"), ("99", "trials of the study are 0 to")):
            assert complaint in coverdrive(command, results, "--trial", trial, status=2)


@pytest.mark.slow
def test_a_study_of_another_seed_is_replayed_as_it_was(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "out", ignore=shutil.ignore_patterns("study", "figures"))
    coverdrive("study", tmp_path / "out", "--seed", "9", "--trials", "1")
    coverdrive("report", tmp_path / "out")
    (stored,) = (tmp_path / "out" / "study" / "traces").iterdir()
    row = pl.read_parquet(tmp_path / "out" / "study" / "trials.parquet").row(0, named=True)
    assert float(load_trace(stored).scene.speed[:, 0].mean()) == row["mean_speed"]
    coverdrive("fit", "--config", reseeded(results), "--out", tmp_path / "out")
    (aside,) = (tmp_path / "out").glob("study@*")
    aside.rename(tmp_path / "out" / "study")
    assert "another predictor" in coverdrive("report", tmp_path / "out", status=2)


@pytest.mark.slow
def test_figures_and_videos_are_made_again(results: Path) -> None:
    files = json.loads(coverdrive("figures", results, "--trial", "1", "--json", only="stdout"))["figures"]
    assert {Path(file).suffix for file in files} == {".png", ".pdf"}
    assert coverdrive("animate", results, "--trial", "1", "--format", "gif", "--quiet") == ""
    assert (results / "figures" / "drive_1.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.slow
def test_results_are_json_for_scripts(results: Path) -> None:
    studied = json.loads(coverdrive_alone("study", results, "--json", only="stdout"))
    assert studied["collisions"][-1]["trials"] == len(studied["trials"])


@pytest.mark.slow
def test_study_goes_on_and_other_settings_are_refused(results: Path) -> None:
    before = pl.read_parquet(results / "study" / "trials.parquet")
    coverdrive_alone("study", results, "--trials", "5", "--workers", "2")
    after = pl.read_parquet(results / "study" / "trials.parquet")
    assert after[:4].equals(before) and after.height == 5
    assert "another configuration" in coverdrive("study", results, "--seed", "4", status=2)


@pytest.mark.slow
def test_drive_repeats_a_trial_of_the_study(results: Path) -> None:
    coverdrive("drive", results, "--trial", "1", "--set", "planner.lane_change=3")
    trace = load_trace(results / "drive_1_4" / "trace.npz")
    row = pl.read_parquet(results / "study" / "trials.parquet").row(1, named=True)
    assert trace.outcome.kind.value == row["kind"]
    assert float(trace.scene.speed[:, 0].mean()) == row["mean_speed"]


@pytest.mark.slow
def test_every_traffic_has_its_own_study(results: Path) -> None:
    for traffic in ("drivers", "aggressive", "mixed"):
        printed = coverdrive(
            "study", results, "--traffic", traffic, "--trials", "3", "--vehicles", "3", "8", "--workers", "1"
        )
        words = " ".join(printed.replace("│", " ").split())
        assert "planning failures" in words and "of windows, with 90 % confidence" in words
        table = pl.read_parquet(results / f"study-{traffic}" / "trials.parquet")
        assert table["vehicles"].to_list() == [3, 8, 3]
        assert table["impossible_choices"].sum() == 0 or traffic == "mixed"


@pytest.mark.slow
def test_replay_takes_the_scenes_that_the_predictor_never_saw(results: Path, tmp_path: Path) -> None:
    printed = coverdrive("study", results, "--traffic", "replay", "--trials", "2", "--workers", "1")
    assert "paper" in printed and "no interval" in printed
    assert pl.read_parquet(results / "study-replay" / "trials.parquet")["vehicles"].min() > 7
    (row,) = pl.read_parquet(results / "study-replay" / "trials.parquet")[1].iter_rows(named=True)
    coverdrive("drive", results, "--trial", "1", "--traffic", "replay")
    coverdrive("drive", results, "--trial", "0", "--traffic", "replay", "--seed", "9")  # the split stays
    (folder,) = results.glob("drive-replay_1_*")
    assert float(load_trace(folder / "trace.npz").scene.speed[:, 0].mean()) == row["mean_speed"]


@pytest.mark.slow
def test_a_study_of_replayed_recordings_is_shown_with_them(results: Path, tmp_path: Path) -> None:
    out, right, wrong = tmp_path / "out", tmp_path / "right.parquet", tmp_path / "wrong.parquet"
    shutil.copytree(results, out, ignore=shutil.ignore_patterns("study*", "figures"))
    for file, seed in ((right, 8), (wrong, 9)):
        recordings = generate(Experiment.load(out / "config.toml").generated, seed)
        renamed = [(f"{each.name} of seed {seed}", each.table.drop("identity")) for each in recordings]
        again = zip(recordings, renamed, strict=True)
        write_parquet([replace(each, name=name, table=table) for each, (name, table) in again], file)
    replayed = ("--traffic", "replay", "--recording")
    coverdrive("study", out, *replayed, right, "--trials", "2", "--workers", "1")
    for named in (wrong, None):  # without a name, that is the generated traffic that made the predictor
        arguments = [*replayed, named] if named else replayed[:2]
        assert "replayed other recordings" in coverdrive("report", out, *arguments, status=2)
    coverdrive("report", out, *replayed, right, "--replays", "1")
    html = (out / "report-replay.html").read_text(encoding="utf-8")
    (shown,) = re.findall(r'id="replay-data-(\d+)"', html)
    assert "out, study-replay" in html
    other = str(1 - int(shown))
    coverdrive("animate", out, *replayed, right, "--trial", other, "--format", "gif")
    coverdrive("animate", out, *replayed[:2], "--trial", other, "--format", "gif")  # stored by now
    assert (out / "figures-replay" / f"drive_{other}.gif").exists()
    for command in ("report", "animate"):
        assert "--traffic drivers" in coverdrive(command, out, "--traffic", "drivers", "--trial", "0", status=2)


@pytest.mark.slow
def test_a_sweep_is_driven_and_its_variants_are_compared(results: Path) -> None:
    swept = ["--set", "planner.problem.obstacles.ignore_rear=true,false", "traffic.kind=drivers"]
    other = ["--traffic", "drivers", "--trials", "3", "--vehicles", "3", "8"]
    coverdrive("study", results, *other, "--workers", "1")
    printed = coverdrive("study", results, "--trials", "3", "--workers", "1", *swept)
    variants = sorted((results / "sweep").iterdir())
    assert [variant.name for variant in variants] == [
        f"planner.problem.obstacles.ignore_rear={value},traffic.kind=drivers" for value in ("false", "true")
    ]
    assert "windows missed" in printed
    assert Experiment.load(variants[1] / "config.toml").planner.problem.obstacles.ignore_rear
    compared = coverdrive("compare", *variants)
    assert "planner.problem.obstacles.ignore_rear: false and true" in compared
    assert "3 pairs of trials" in compared
    assert json.loads(coverdrive("compare", *variants, "--json", only="stdout"))["trials"] == 3
    assert "numbers of vehicles differ" in coverdrive("compare", results / "study-drivers", variants[0], status=2)


@pytest.mark.slow
def test_certify_compares_all_methods(results: Path) -> None:
    compared = outcomes(results)
    printed = coverdrive("calibrations", results, "--epsilon", "0.2")
    assert outcomes(results) == [each for each in compared if each["target"] in (None, 0.2)]  # as `run` has them
    for method in Method:
        assert f"{method.value}: {method.help}"[:60] in printed
    table = pl.read_csv(results / "methods.csv")
    assert table.height == len(Method)
    assert (results / "figures" / "methods.png").exists()
    assert [each.method for each in Results(results).methods] == list(Method)
    coverdrive("fit", "--config", reseeded(results), "--out", results)
    assert Results(results).methods == []  # those of another predictor are void


def outcomes(results: Path) -> list[dict[str, Any]]:
    """What a comparison of methods found, wall times apart."""
    methods = json.loads((results / "methods.json").read_text())["methods"]
    return [{name: value for name, value in each.items() if name != "seconds"} for each in methods]


def reseeded(results: Path) -> Path:
    """The settings of a results folder with another seed, and so another split of the same recordings."""
    path = results.parent / "reseeded.toml"
    path.write_text((results.parent / "quick.toml").read_text().replace("seed = 3", "seed = 4"))
    return path


@pytest.mark.slow
@pytest.mark.real_data
def test_inspect_reads_all_real_recordings(us101: Path) -> None:
    printed = coverdrive("inspect", us101 / "ngsim", us101 / "commonroad")
    for name in ("us101_around_vehicle_320", "us101_around_vehicle_888", "USA_US101-33_1_T-1"):
        assert name in printed


@pytest.mark.slow
def test_folds_print_their_spread_and_keep_nothing(quick_run: Path, tmp_path: Path) -> None:
    options = ("--folds", "3", "--config", quick_run / "quick.toml", "--out", tmp_path / "out")
    found = json.loads(coverdrive("fit", *options, "--json", only="stdout"))["folds"]
    assert len(found) == 6 and all(each["evaluation"]["windows"]["total"] > 0 for each in found)
    claim = ("--epsilon", "0.1", "--unit", "group", "--set", "prediction.certificate.method=pac-pooled")
    printed = coverdrive("fit", *options, *claim)
    assert "refused" in printed and "groups would do" in printed
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_refused_certificate_leaves_nothing_behind(quick_run: Path, tmp_path: Path) -> None:
    config, quick = tmp_path / "strict.toml", (quick_run / "quick.toml").read_text()
    config.write_text(quick.replace('unit = "window"', 'unit = "window"\nmethod = "pac-pooled"\nepsilon = 1e-6'))
    printed = coverdrive("fit", "--config", config, "--out", tmp_path / "out", status=2)
    assert "cannot prove ε = 1e-06 by pac-pooled" in printed and "the smallest ε possible with them is" in printed
    assert [path.name for path in tmp_path.iterdir()] == ["strict.toml"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a disk that is always full")
def test_a_disk_without_room_is_told_before_anything_is_learned(
    quick_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("coverdrive.prediction.fit.fit", lambda *_: pytest.fail("it learns"))
    with Path("/dev/full").open("wb", buffering=0) as full:
        monkeypatch.setattr("coverdrive.cli.learning.fit.TemporaryFile", lambda dir: full)
        printed = coverdrive("fit", "--config", quick_run / "quick.toml", "--out", tmp_path / "out", status=2)
    assert "No space left on device; make room" in printed and not list(tmp_path.iterdir())


COMMANDS = [name for name in app if not name.startswith("-")]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_teaches(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    help_of = partial(app.help_print, console=Console(width=80))
    help_of([command])
    printed = " ".join(capsys.readouterr().out.split())
    examples = re.findall(r"`(coverdrive[^`]*)`", str(app[command].help))
    assert len(examples) >= 2
    for example in examples:
        assert example in printed
        name, *arguments = example.split()[1:]
        called, _, unused = app.parse_args([name, *arguments], print_error=False, exit_on_error=False)
        assert called.__name__ == command and not unused
    assert "--empty-" not in printed


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_has_an_example(command: str) -> None:
    for option in app[command].assemble_argument_collection():
        assert option.children or option.hint in (bool, bool | None) or "as in `" in str(option.parameter.help), (
            option.name
        )


def test_help_lists_commands_in_the_order_of_a_first_visit(capsys: pytest.CaptureFixture[str]) -> None:
    printed = coverdrive_alone("--help", only="stdout")
    listed = re.findall(r"^│ (\w+)  ", printed, re.MULTILINE)
    assert listed[:4] == ["demo", "run", "inspect", "fit"] and sorted(listed) == sorted(COMMANDS)
    for status in ("0, done", "1, an error", "2, something", "130, stopped"):
        assert status in " ".join(printed.split())


def test_help_says_the_defaults_of_the_settings(capsys: pytest.CaptureFixture[str]) -> None:
    experiment = Experiment()
    vehicles = " ".join(map(str, experiment.study.vehicles))
    defaults = {
        "study": (experiment.study.trials, experiment.study.workers, experiment.seed, experiment.traffic.kind),
        "run": (f"{vehicles}, as in the paper,",),
        "calibrations": (experiment.prediction.certificate.unit,),
        "basis": (experiment.prediction.segments.stride,),
    }
    for command, values in defaults.items():
        app.help_print([command], console=Console(width=1000))
        printed = capsys.readouterr().out
        assert [value for value in values if f"[default: {value} unless the settings differ]" not in printed] == []


def test_help_says_several_numbers_as_they_are_given(capsys: pytest.CaptureFixture[str]) -> None:
    for command, values in (("calibrations", "0.05 0.1 0.2"), ("basis", "0.5 0.75 1 2")):
        app.help_print([command], console=Console(width=1000))
        assert f"[default: {values}]" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for other processes")
@pytest.mark.parametrize(("number", "status", "workers"), [(signal.SIGINT, 130, "1"), (signal.SIGTERM, 143, "2")])
def test_a_stopped_study_says_how_to_go_on(
    number: signal.Signals, status: int, workers: str, results: Path, tmp_path: Path, heeds_interrupts: None
) -> None:
    shutil.copytree(results, tmp_path / "out", ignore=shutil.ignore_patterns("study", "figures"))
    command = [sys.executable, "-m", "coverdrive", "study", tmp_path / "out", "--trials", "500", "--workers", workers]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        while process.poll() is None and not list((tmp_path / "out").glob("study/trials/*")):
            time.sleep(0.1)
        process.send_signal(number)
        _, complaint = process.communicate()
    assert process.returncode == status, complaint
    assert "goes on from them" in complaint and "Traceback" not in complaint


def test_an_interrupt_outside_of_a_study_promises_nothing(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "app", SimpleNamespace(meta=interrupted))
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 130 and capsys.readouterr().err == "stopped\n"


def test_recordings_are_read_as_asked_for(tmp_path: Path) -> None:
    one = generate(Experiment().generated.model_copy(update={"scenes": 1, "duration": 5.0}))
    write_parquet(one, tmp_path / "own.parquet")
    asked = ("inspect", tmp_path / "own.parquet", "--format", "OWN", "--dt", "0.2", "--json")
    (found,) = json.loads(coverdrive(*asked, only="stdout"))["recordings"]
    assert found["dt"] == 0.2 and found["notes"]["resampled"].startswith("10 Hz to 5 Hz after")
    assert "there is no format 'none'" in coverdrive("inspect", tmp_path / "own.parquet", "--format", "none", status=2)


def test_a_name_that_looks_like_json_or_markup_is_a_name(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    one = generate(Experiment().generated.model_copy(update={"scenes": 1, "duration": 5.0}))
    names = ["[x].parquet", "[red]a.parquet", "{y}.parquet"]
    for name in names:
        write_parquet(one, tmp_path / name)
    found = json.loads(coverdrive("inspect", *names, "--json", only="stdout"))
    assert len(found["recordings"]) == 3


@pytest.mark.slow
def test_inspect_draws_each_recording_and_all_speeds(tmp_path: Path) -> None:
    one = generate(Experiment().generated.model_copy(update={"scenes": 2, "duration": 5.0}))
    write_parquet(one, tmp_path / "two.parquet")
    printed = coverdrive(
        "inspect", tmp_path / "two.parquet", "--plot", tmp_path / "road.png", "--histogram", tmp_path / "all"
    )
    names = {"road-1.png", "road-1.pdf", "road-2.png", "road-2.pdf", "all.png", "all.pdf"}
    assert {file.name for file in tmp_path.iterdir()} == names | {"two.parquet"}
    assert all(name in printed for name in names)
