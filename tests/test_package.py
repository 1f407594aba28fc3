"""What the package promises as a whole: light imports, and a README that is true."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import coverdrive

HEAVY = (
    "jax",
    "equinox",
    "casadi",
    "numba",
    "polars",
    "scipy",
    "matplotlib",
    "av",
    "jinja2",
    "pydantic",
    "numpy",
    "commonroad",
    "joblib",
)
README = Path(__file__).parents[1] / "README.md"


@pytest.mark.parametrize(
    ("module", "heavy"),
    [("coverdrive", HEAVY), ("coverdrive.cli", tuple(name for name in HEAVY if name not in ("numpy", "pydantic")))],
)
def test_importing_loads_nothing_heavy(module: str, heavy: tuple[str, ...]) -> None:
    code = f"import sys, {module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not set(heavy) & set(loaded)


def test_readme_has_the_two_commands() -> None:
    commands = re.findall(r"```sh\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(commands) == 2
    assert "coverdrive run" in commands[0] and commands[1].rstrip().endswith("pytest")


def test_no_name_of_the_facade_is_hidden_by_a_package() -> None:
    packages = {path.name for path in (Path(__file__).parents[1] / "src" / "coverdrive").iterdir()}
    assert not packages & set(coverdrive.__all__)


def test_the_version_is_the_same_everywhere() -> None:
    root = README.parent
    cited = re.findall(r"^version: (\S+)$", (root / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    changes = re.findall(r"^## (\d\S*)", (root / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert [cited[0], changes[0]] == [coverdrive.__version__] * 2
