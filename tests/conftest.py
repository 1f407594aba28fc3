"""Options, limits and fixtures of all tests."""

import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

from shape_checks import check_all_calls

if TYPE_CHECKING:
    from coverdrive.paths import PredictedPaths

check_all_calls("coverdrive")
for name, examples in {"fast": 25, "all": 60}.items():  # no deadline: a first call compiles
    settings.register_profile(
        name, deadline=None, derandomize=True, max_examples=examples, suppress_health_check=[HealthCheck.too_slow]
    )

QUICK = """
seed = 3

[generated]
scenes = 6
duration = 20.0
vehicles = [10, 12]

[prediction]
sets = "bases"

[prediction.basis]
radius = 1.0

[prediction.training]
epochs = 4

[prediction.certificate]
confidence = 0.9
unit = "window"

[episode]
duration = 1.0

[study]
workers = 1
"""
"""settings of a run that takes seconds; functions that the tests check cannot be sent to other processes"""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--all", action="store_true", help="Run the slow tests, too.")


def pytest_configure(config: pytest.Config) -> None:
    everything = config.getoption("--all")
    settings.load_profile("all" if everything else "fast")
    keep_machine_code(config.cache.mkdir("jax"), optimize=everything)


def keep_machine_code(folder: Path, optimize: bool) -> None:
    """Let JAX keep what it compiles, and compile quickly unless it is to optimize.

    It reads the environment when it is imported, as it may have been by a conftest.py of what was named.
    """
    kept = {
        "jax_compilation_cache_dir": str(folder / ("optimized" if optimize else "quick")),
        "jax_persistent_cache_min_compile_time_secs": 0,
        "jax_persistent_cache_min_entry_size_bytes": -1,
    }
    os.environ.update({name.upper(): str(value) for name, value in kept.items()})
    if "jax" in sys.modules:
        for name, value in kept.items():
            sys.modules["jax"].config.update(name, value)
    if not optimize:
        os.environ["XLA_FLAGS"] = "--xla_backend_optimization_level=0 --xla_llvm_disable_expensive_passes=true"


def pytest_report_header(config: pytest.Config) -> str:
    return "tests: all" if config.getoption("--all") else "tests: the fast ones; `pytest --all` runs the slow ones, too"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out slow tests, unless they are asked for by an option or by name."""
    slow = [item for item in items if item.get_closest_marker("slow")]
    for item in slow:
        item.add_marker(pytest.mark.timeout(900))
    named = any("::" in argument for argument in config.args)
    if not (config.getoption("--all") or config.getoption("-m") or named):
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if item not in set(slow)]


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], None]], Path]:
    """A function that gives a folder of a name, filled once for all processes of the session; leave it as it is."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def folder_of(name: str, fill: Callable[[Path], None]) -> Path:
        folder, complete = shared / f"once-{name}", shared / f"once-{name}.complete"
        with FileLock(shared / f"once-{name}.lock"):
            if not complete.exists():
                shutil.rmtree(folder, ignore_errors=True)  # of one that failed
                folder.mkdir()
                fill(folder)
                complete.touch()
        return folder

    return folder_of


@pytest.fixture(scope="session")
def quick_run(once: Callable[[str, Callable[[Path], None]], Path]) -> Path:
    """A folder with the results of one quick ``coverdrive run`` in ``out``, its settings and what it printed."""
    from command import coverdrive

    def run(folder: Path) -> None:
        (folder / "quick.toml").write_text(QUICK)
        printed = coverdrive("run", "--config", folder / "quick.toml", "--trials", "4", "--out", folder / "out")
        (folder / "printed.txt").write_text(printed, encoding="utf-8")

    return once("quick-run", run)


@pytest.fixture(scope="session")
def quick_fit(once: Callable[[str, Callable[[Path], None]], Path]) -> Path:
    """A results folder with a quick fit."""

    def fit(folder: Path) -> None:
        from coverdrive.config import Experiment
        from coverdrive.prediction.fit import fit
        from coverdrive.results import Results

        (folder / "quick.toml").write_text(QUICK)
        experiment = Experiment.load(folder / "quick.toml")
        result = fit(experiment.recordings([]), experiment.prediction, experiment.seed)
        Results(folder).save_fit(experiment, result)

    return once("quick-fit", fit)


@pytest.fixture(scope="session")
def quick_predictor(quick_fit: Path) -> Path:
    """The file of the predictor of a quick fit."""
    return quick_fit / "predictor.safetensors"


@pytest.fixture
def hardly_trained(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks see their samples ten times at most, where any that is certified will do; not those of ``once``."""
    from coverdrive.prediction.learning.training import OptimiserSettings

    passes = OptimiserSettings.passes
    monkeypatch.setattr(OptimiserSettings, "passes", lambda self, samples: min(10, passes(self, samples)))


@pytest.fixture(scope="session")
def us101() -> Path:
    """The folder of recorded US-101 traffic; where nobody says that it is there, tests that need it are skipped."""
    named = os.environ.get("COVERDRIVE_DATA")
    if named is None:
        pytest.skip("needs recorded US-101 traffic; set COVERDRIVE_DATA to the folder that holds us101/")
    folder = Path(named) / "us101"
    if not folder.is_dir():
        pytest.fail(f"COVERDRIVE_DATA is {named}, but there is no folder us101 in it")
    return folder


@pytest.fixture(scope="session")
def roads(us101: Path) -> Path:
    """The folder of CommonRoad scenarios with curves and ramps, beside that of US-101."""
    folder = us101.parent / "roads"
    if not folder.is_dir():
        pytest.skip(f"there is no folder roads in {us101.parent}")
    return folder


@pytest.fixture
def straight_paths() -> "Callable[..., PredictedPaths]":
    """A function of rows (lon, lat, speed) that gives one path of constant speed per row, one vehicle each."""
    from coverdrive.paths import PredictedPaths

    def make(*rows: tuple[float, float, float]) -> PredictedPaths:
        cars = np.reshape(np.array(rows, dtype=float), (-1, 3))
        points = np.zeros((len(cars), 13, 2))
        points[..., 0] = cars[:, 0, None] + cars[:, 2, None] * 0.25 * np.arange(13)
        points[..., 1] = cars[:, 1, None]
        half_sizes = np.tile([2.4, 0.95], (len(cars), 13, 1))
        return PredictedPaths(points, np.arange(len(cars)), half_sizes, 0.25)

    return make


@pytest.fixture
def uncollected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Studies that collect no garbage before they begin, which takes longer than the drives of a toy."""
    monkeypatch.setattr("coverdrive.simulation.studies.workers._freeze", lambda: None)


@pytest.fixture
def heeds_interrupts() -> Iterator[None]:
    """A job in the background ignores SIGINT, and so would all that it starts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
