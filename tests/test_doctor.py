"""What the doctor finds, and what it advises."""

import json
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from coverdrive import doctor


def test_all_that_is_needed_is_here(tmp_path: Path) -> None:
    findings = doctor.examine(tmp_path / "new" / "results")
    assert [finding for finding in findings if finding.needed and not finding.fine] == []
    assert {"JAX device", "solver fatrop", "solver ipopt", "ffmpeg", "numpy"} <= {finding.name for finding in findings}
    assert list(tmp_path.iterdir()) == []


def test_a_missing_package_is_named_with_the_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def fail(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(doctor, "version", fail)
    found = {finding.name: finding for finding in doctor.examine(tmp_path)}
    assert not found["scipy"].fine and found["scipy"].hint == "pip install scipy"
    assert not found["Chromium and Playwright"].needed


def test_data_that_cannot_be_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("COVERDRIVE_DATA", str(tmp_path))
    (found,) = (each for each in doctor.examine(tmp_path) if each.name == "recorded US-101 traffic")
    assert not found.fine and "nothing readable" in found.found


@pytest.mark.slow
def test_the_command_as_json_and_quiet(tmp_path: Path) -> None:
    def run(*options: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "coverdrive", "doctor", *options]
        return subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)

    assert json.loads(run("--json").stdout)["missing"] == []
    quiet = run("--quiet")
    assert (quiet.stdout, quiet.stderr) == ("", "")
