"""However the command ends: one clear line, an exit status, and JSON where JSON is wanted."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

from coverdrive import cli
from coverdrive.cli.shared.edge import status_of
from coverdrive.cli.shared.options import console
from coverdrive.cli.shared.terminal import OutputClosed
from coverdrive.errors import SettingError


def raising(error: BaseException) -> Callable[[], NoReturn]:
    def work() -> NoReturn:
        raise error

    return work


def system(number: int, *files: str | None) -> OSError:
    return OSError(number, os.strerror(number), *files)


def file_and_file(number: int, first: str, second: str) -> OSError:
    return OSError(number, os.strerror(number), first, None, second)


ENDINGS = [
    (SettingError("study.trials: too many"), 2, "error: study.trials: too many"),
    (
        system(errno.EACCES, "a.csv"),
        2,
        "error: a.csv: Permission denied; ask for the permission, or name another folder, or a copy",
    ),
    (
        system(errno.EROFS, "out"),
        2,
        "error: out: Read-only file system; name a folder that you can write to",
    ),
    (system(errno.ENAMETOOLONG, "aaa"), 2, "error: aaa: File name too long; take a shorter name"),
    (system(errno.ENOSPC), 2, "error: No space left on device; make room"),
    (system(errno.EISDIR, "[red]folder[/b]"), 2, "error: [red]folder[/b]: Is a directory"),
    (system(errno.EPIPE), 2, "error: Broken pipe"),
    (system(errno.EIO, ":car:.csv"), 2, "error: :car:.csv: Input/output error"),
    (file_and_file(errno.EXDEV, "one", "other"), 2, "error: one → other: "),
    (OSError("No space left on device (os error 28)"), 2, "error: No space left on device (os error 28)"),
    (OSError(), 2, "error: OSError"),
    (MemoryError("1.2 TiB"), 2, "error: not enough memory (1.2 TiB)"),
    (KeyboardInterrupt(), 130, "stopped"),
    (OutputClosed(), 141, ""),
    (ZeroDivisionError("division by zero"), 1, "this should not happen: please report it"),
]


@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.parametrize(("error", "status", "said"), ENDINGS)
def test_every_end_has_a_line_and_a_status(
    error: BaseException, status: int, said: str, as_json: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status_of(raising(error), lambda: as_json) == status
    printed, complained = capsys.readouterr()
    assert said in complained and bool(said) == bool(complained)
    assert ("Traceback" in complained) == (status == 1)
    if status == 2:
        assert complained.count("\n") == 1
    assert bool(printed) == (as_json and bool(said))
    if printed:
        assert json.loads(printed)["error"] in complained.replace("\n", " ") + "ZeroDivisionError: division by zero"


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_work_and_handlers_are_as_before(
    number: signal.Signals, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.signal(number, {signal.SIGINT: signal.default_int_handler}.get(number, signal.SIG_DFL))
    try:
        usual = signal.getsignal(number)
        assert status_of(lambda: signal.raise_signal(number), lambda: False) == status
        assert signal.getsignal(number) is usual
    finally:
        signal.signal(number, before)
    assert capsys.readouterr().err == "stopped\n"


def test_a_signal_that_is_ignored_stays_so() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert status_of(lambda: signal.raise_signal(signal.SIGTERM), lambda: False) == 0
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_what_a_terminal_cannot_show_is_replaced(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    for setting in ("quiet", "stderr"):  # whatever another test has left
        monkeypatch.setattr(console, setting, False)

    def work() -> dict[str, str]:
        console.print("ε ≤ 10 %, 2 m/s² – Jütland \udce4 :car: [red]name[/b]")
        raise SettingError("ε ≤ 1 \udce4")

    assert status_of(work, lambda: False) == 2
    printed = out.buffer.getvalue().decode(encoding)
    assert "m/s" in printed and "[red]name[/b]" in printed and ":car:" in printed
    assert "ε" in printed or encoding != "utf-8"
    assert "error: " in err.buffer.getvalue().decode(encoding)


def test_a_result_is_json_whatever_is_in_it(capsys: pytest.CaptureFixture[str]) -> None:
    result = {"rate": float("nan"), "most": float("inf"), "name": "\udce4 [red]", 3: (Path("a"), [None, 1.5])}
    assert status_of(lambda: result, lambda: True) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {"rate": None, "most": None, "name": "\udce4 [red]", "3": ["a", [None, 1.5]]}


def called(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """Exit status, stdout and stderr of the command."""
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert isinstance(ended.value.code, int)
    return ended.value.code, *capsys.readouterr()


BAD_CALLS = [
    (["run", "--vehicles", "100000"], "--vehicles"),
    (["run", "--trials", "1e20"], "--trials"),
    (["run", "--trials", "-3"], "study.trials"),
    (["run", "--seed", "1e23"], "seed"),
    (["run", "--workers", "100000"], "study.workers"),
    (["run", "--epsilon", "nan"], "prediction.certificate.epsilon"),
    (["run", "--epsilon", "often"], "--epsilon"),
    (["fit", "--confidence", "inf"], "prediction.certificate.confidence"),
    (["fit", "--unit", "kilometre"], "--unit"),
    (["fit", "--set", "prediction.basis.epsilom=1"], "prediction.basis.epsilom"),
    (["fit", "--set", "prediction.basis.radius=inf"], "prediction.basis.radius"),
    (["fit", "--set", "prediction.basis.radius"], "is no setting with its value"),
    (["fit", "--set", "prediction=3"], "prediction"),
    (["calibrations", "--epsilon", "nan"], "--epsilon"),
    (["calibrations", "--epsilon", "0.1", "2"], "--epsilon"),
    (["basis", "--epsilon", "inf"], "--epsilon"),
    (["basis", "--stride", "nan"], "prediction.segments.stride"),
    (["drive", "--trial", "-5"], "--trial"),
    (["drive", "--vehicles", "100000"], "--vehicles"),
    (["report", "--trial", "-5"], "--trial"),
    (["report", "--replays", "-1"], "--replays"),
    (["animate", "--trial", "-5"], "--trial"),
    (["figures", "--trial", "1e20"], "--trial"),
    (["inspect", "[red]missing[/b].csv"], "[red]missing[/b].csv"),
    (["inspect", "a" * 300], "File name too long"),
    (["study", "a" * 300], "File name too long"),
    (["fit", "--config", "a" * 300], "File name too long"),
    (["fit", "--config", "."], "not a readable TOML file"),
    (["study", "--until-width", "2"], "--until-width"),
    (["bogus"], "bogus"),
    (["run", "--trails", "3"], "--trials"),
    (["run", "--traffic", "bicycles"], "set-sampling"),
    (["animate", "--format", "avi"], "--format"),
    (["inspect"], "nothing to inspect"),
    (["compare", "here", "there"], "here holds no study"),
    *(
        ([name, "no"], "no results in no; make some with `coverdrive run --out no`")
        for name in ("study", "report", "figures", "animate")
    ),
]


@pytest.mark.parametrize(("arguments", "complaint"), BAD_CALLS, ids=lambda value: " ".join(value)[:40])
def test_bad_calls_end_in_one_line(
    arguments: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    status, printed, complained = called([*arguments, "--json"], capsys)
    assert status == 2 and "Traceback" not in complained
    assert complaint in complained.replace("\n", "")
    assert complaint in json.loads(printed)["error"].replace("\n", "")
    assert list(tmp_path.iterdir()) == []


def test_a_setting_of_the_command_line_holds_over_a_file(tmp_path: Path) -> None:
    from coverdrive.cli.shared.options import experiment_of

    (tmp_path / "mine.toml").write_text("seed = 3\n[prediction.certificate]\nepsilon = 0.3\n")
    usual = {"prediction": {"certificate": {"epsilon": 0.25}}}

    def epsilon(config: Path | None = None, settings: list[str] | None = None, given: float | None = None) -> Any:
        claim = {"certificate": {"epsilon": given}}
        made = experiment_of(config, "default", settings, usual, prediction=claim)
        return made.prediction.certificate.epsilon

    assert epsilon() == 0.25
    assert epsilon(tmp_path / "mine.toml") == 0.3
    assert epsilon(tmp_path / "mine.toml", given=0.2) == 0.2
    assert epsilon(tmp_path / "mine.toml", ["prediction.certificate.epsilon=0.1"], 0.2) == 0.1
    assert experiment_of().prediction.certificate.epsilon == "auto"
    made = experiment_of(settings=["traffic.gap=9"], traffic={"kind": "drivers"})
    assert made.traffic.model_dump()["gap"] == 9


COMMAND = [sys.executable, "-m", "coverdrive"]


def status_to(arguments: list[str], out: int) -> tuple[int, str]:
    """Exit status and complaints of a process that prints to a file descriptor, which is closed here."""
    with subprocess.Popen([*COMMAND, *arguments], stdout=out, stderr=subprocess.PIPE, text=True) as process:
        os.close(out)
        assert process.stderr is not None
        complaints = process.stderr.read()
    return process.returncode, complaints


@pytest.mark.skipif(sys.platform == "win32", reason="needs pipes and devices of Unix")
def test_output_that_nobody_reads_ends_silently() -> None:
    read, write = os.pipe()
    os.close(read)
    assert status_to(["--help"], write) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_output_to_a_full_disk_is_said() -> None:
    status, complaints = status_to(["--help"], os.open("/dev/full", os.O_WRONLY))
    assert status == 2 and complaints.startswith("error: No space left on device") and "Exception" not in complaints


@pytest.mark.parametrize(
    ("result", "status"), [({"missing": ["x"]}, 1), ({"undriven": ["x"]}, 3), ({"undriven": []}, 0)]
)
def test_what_is_found_is_a_status(result: dict[str, list[str]], status: int):
    assert status_of(lambda: result, lambda: False) == status
