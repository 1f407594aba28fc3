"""What the doctor finds, and what it advises."""

import json
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

from command import coverdrive
from coverdrive import doctor

COMMAND = [sys.executable, "-m", "coverdrive", "doctor"]


def test_all_that_is_needed_is_here(tmp_path: Path) -> None:
    findings = doctor.examine(tmp_path / "new" / "results")
    assert [finding for finding in findings if finding.needed and not finding.fine] == []
    assert {"JAX device", "CasADi", "PIQP", "Dask", "ffmpeg", "numpy"} <= {finding.name for finding in findings}
    assert list(tmp_path.iterdir()) == []


def test_a_missing_package_is_named_with_the_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def fail(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(doctor, "version", fail)
    found = {finding.name: finding for finding in doctor.examine(tmp_path)}
    assert not found["scipy"].fine and found["scipy"].found == "not installed"
    assert found["scipy"].hint.startswith('pip install --upgrade "scipy>=')
    assert not found["CasADi"].needed


def test_a_package_that_is_too_old_is_named_with_the_bound(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(doctor, "requires", lambda name: ["scipy>=1.0", "numpy>=999", 'piqp>=999; extra == "other"'])
    found = {finding.name: finding for finding in doctor.examine(tmp_path)}
    assert found["scipy"].fine and "piqp" not in found
    assert not found["numpy"].fine and found["numpy"].found == f"{version('numpy')}, but coverdrive needs >=999"
    assert found["numpy"].hint == 'pip install --upgrade "numpy>=999"'


def test_a_package_that_cannot_be_imported_is_broken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Its metadata alone say that it is fine."""
    (tmp_path / "brokenpackage-1.5.dist-info").mkdir()
    metadata = "Metadata-Version: 2.1\nName: brokenpackage\nVersion: 1.5\n"
    (tmp_path / "brokenpackage-1.5.dist-info" / "METADATA").write_text(metadata)
    (tmp_path / "brokenpackage.py").write_text("raise OSError('libbroken.so: not found\\nand more')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(doctor, "requires", lambda name: ["brokenpackage>=1"])
    (found,) = (each for each in doctor.examine(tmp_path) if each.name == "brokenpackage")
    assert not found.fine and found.needed
    assert found.found == "1.5, but it cannot be imported (OSError: libbroken.so: not found)"


def test_a_cache_of_compiled_code_that_cannot_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    (found,) = (each for each in doctor.examine(tmp_path) if each.name == "cache of Numba")
    assert not found.fine and not found.needed and "NUMBA_CACHE_DIR" in found.hint
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (found,) = (each for each in doctor.examine(tmp_path) if each.name == "cache of Numba")
    assert found.fine and str(tmp_path / "cache") in found.found


@pytest.mark.slow
def test_the_command_as_json_and_quiet_and_its_status(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert json.loads(coverdrive("doctor", "--json", only="stdout"))["missing"] == []
    (tmp_path / "file").touch()
    assert "Missing: results." in coverdrive("doctor", "file/results", status=1, only="stdout")
    quiet = subprocess.run([*COMMAND, "--quiet"], capture_output=True, text=True, check=True)
    assert (quiet.stdout, quiet.stderr) == ("", "")
