"""What is not installed is named with the command that installs it, where it is asked for."""

import sys
import tomllib
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

from coverdrive import doctor
from coverdrive.certificates.support_vectors import _solve
from coverdrive.errors import MissingExtraError
from coverdrive.extras import EXTRAS, require


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """An installation without extras."""
    for module in EXTRAS:
        monkeypatch.setitem(sys.modules, module, None)


@pytest.mark.parametrize("module", EXTRAS)
def test_a_module_that_is_there(module: str) -> None:
    if module == "libsumo":
        pytest.importorskip(module, reason="its system libraries are missing", exc_type=ImportError)
    assert require(module).__name__.startswith(module)


@pytest.mark.parametrize("module", EXTRAS)
def test_a_module_that_is_not_there(module: str, bare: None) -> None:
    with pytest.raises(MissingExtraError) as refused:
        require(module)
    assert f"pip install '.[{EXTRAS[module].extra}]'" in str(refused.value)
    assert EXTRAS[module].package in str(refused.value)


def test_a_module_that_is_there_and_does_not_load(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "libsumo.py").write_text("raise ImportError('libX11.so.6: cannot open shared object file')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "libsumo", raising=False)
    with pytest.raises(MissingExtraError, match=r"installed, but does not load: libX11\.so\.6: cannot open") as refused:
        require("libsumo")
    assert "pip install" not in str(refused.value)


def test_the_papers_program_needs_casadi(bare: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "coverdrive.league.paper_way", raising=False)
    with pytest.raises(MissingExtraError, match=r"the paper's program needs CasADi"):
        import coverdrive.league.paper_way  # noqa: F401


def test_support_vectors_need_piqp(bare: None) -> None:
    with pytest.raises(MissingExtraError, match=r"the method svm needs PIQP"):
        _solve(np.ones((1, 1)), np.zeros((1, 1)))


def test_no_extra_is_required_and_the_tests_have_all() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {Requirement(line).name.replace("-", "_") for line in project["dependencies"]}.isdisjoint(EXTRAS)
    extras = project["optional-dependencies"]
    for module, extra in EXTRAS.items():
        assert [Requirement(line).name.replace("-", "_") for line in extras[extra.extra]] == [module]
        assert extra.extra in next(iter(Requirement(line) for line in extras["test"] if "coverdrive" in line)).extras


def test_the_doctor_misses_no_extra(bare: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    known = doctor.version

    def version(name: str) -> str:
        if name in EXTRAS:
            raise PackageNotFoundError(name)
        return known(name)

    monkeypatch.setattr(doctor, "version", version)
    found = {finding.name: finding for finding in doctor.examine(tmp_path)}
    for extra in EXTRAS.values():
        finding = found[extra.package]
        assert not finding.fine and not finding.needed
        assert finding.found == "not installed" and extra.command in finding.hint
