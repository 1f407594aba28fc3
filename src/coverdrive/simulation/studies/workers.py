"""Running trials on one process, on several, or on a Dask cluster; rows come back to the caller as they finish.

Each worker process builds the participants once per study. Trials of one process never run at the same time, even if
it has several threads, because solvers cannot be shared between threads.
"""

import gc
import os
import pickle
import threading
import uuid
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache, partial
from typing import Any, Protocol, runtime_checkable

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky import get_reusable_executor  # pyright: ignore[reportMissingTypeStubs]

from coverdrive.errors import DataError, SettingError
from coverdrive.extras import require
from coverdrive.simulation.measures.trial import Row
from coverdrive.simulation.studies.orphans import begin_worker

_CONNECT = "10s"
"""time that a cluster has to answer"""


@runtime_checkable
class Drives(Protocol):
    """Trials of one kind that any process can drive, as `coverdrive.simulation.studies.setup.Setup` does."""

    @property
    def seed(self) -> int:
        """Of all of them."""
        ...

    def description(self) -> dict[str, Any]:
        """Everything that the result of a trial depends on, as JSON values."""
        ...

    def participants(self) -> Any:
        """Who takes part, made for this process."""
        ...

    def row(self, trial: int, participants: Any) -> Row:
        """Drive one trial, and keep its measures."""
        ...


def run_trials(setup: Drives, trials: Sequence[int], workers: int, cluster: str | None = None) -> Generator[Row]:
    """Run trials in any order, yielding the row of each when it is done; all else as in `coverdrive.study`.

    Raises:
        SettingError: there is no cluster.
        MissingExtraError: the package for it is not installed.
        DataError: a worker process was killed.
    """
    if not trials:
        return
    at_once = min(workers, len(trials)) if cluster is None else -1  # as many as the cluster has
    if at_once > 1 or cluster is not None:
        study = uuid.uuid4().hex
        with _processes() if cluster is None else _cluster(cluster):
            yield from _parallel(at_once, (delayed(_run_in_worker)(setup, study, trial) for trial in trials))
    else:
        participants = setup.participants()
        gc.freeze()
        try:
            for trial in trials:
                yield setup.row(trial, participants)
                _freeze()
        finally:
            gc.unfreeze()


def call_all(functions: Sequence[Callable[[], object]], workers: int) -> Generator[None]:
    """Call functions that any process can call, in the processes of the trials, yielding after each; or one by one.

    Raises:
        DataError: a worker process was killed.
    """
    if workers > 1 and len(functions) > 1:
        with _processes():
            for _ in _parallel(workers, (delayed(_called)(each) for each in functions)):
                yield
    else:
        for each in functions:
            each()
            yield


def _called(function: Callable[[], object]) -> None:
    """Call a function; what it returns stays in this process."""
    function()


@contextmanager
def _processes() -> Generator[None]:
    """Let joblib run on processes of this machine, which end with this one and serve until then."""
    try:
        with parallel_config("loky", inner_max_num_threads=1, initializer=_beginning(os.getpid())):
            yield
    except BrokenProcessPool as error:
        raise DataError(
            "a worker process was killed, most often because memory ran out; finished trials are kept: start the "
            "same command again, with fewer --workers"
        ) from error


@cache
def _beginning(process: int) -> Callable[[], None]:
    """What a worker of a process begins with: always the same function, or joblib would start other workers for it."""
    return partial(begin_worker, process)


def end_processes() -> None:
    """End at once the processes that wait for more to do; left alone, they take seconds to end with this one."""
    get_reusable_executor(reuse=True).shutdown(kill_workers=True)  # pyright: ignore[reportArgumentType]


def _parallel(workers: int, calls: Iterable[Any]) -> Generator[Any]:
    """What calls of joblib's return, as they are done; of those left when the caller stops, joblib would warn."""
    parallel = Parallel(n_jobs=workers, batch_size=1, return_as="generator_unordered")  # pyright: ignore[reportArgumentType]
    found: Any = parallel(calls)
    try:
        for each in found:  # noqa: UP028 - `yield from` would end it before warnings are silent
            yield each
    finally:
        with warnings.catch_warnings(category=UserWarning, action="ignore"):
            found.close()


@contextmanager
def _cluster(address: str) -> Generator[None]:
    """Let joblib run on the workers of a Dask scheduler; a task whose worker dies is given to another."""
    dask = require("distributed")
    try:
        client = dask.Client(address, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SettingError(
            f"no Dask scheduler answers at {address} ({error}); start one with `dask scheduler`, and workers with "
            "`dask worker ADDRESS --nthreads 1`"
        ) from error
    with client, parallel_config(backend="dask", client=client):
        yield


_participants: dict[str, Any] = {}
"""of this process, by study; at most one entry, because processes are kept for the next study"""

_driving = threading.Lock()
"""held while a trial runs in this process"""


def _run_in_worker(setup: Drives, study: str, trial: int) -> Row:
    """Run a trial in this process, with participants that were built on its first one of the study."""
    with _driving, _errors_that_travel():
        if study not in _participants:
            _participants.clear()
            gc.unfreeze()
            _participants[study] = setup.participants()
            gc.freeze()
        row = setup.row(trial, _participants[study])
        _freeze()
        return row


@contextmanager
def _errors_that_travel() -> Generator[None]:
    """Raise, instead of an exception of the user's that cannot be sent to another process, one that says the same."""
    try:
        yield
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            said = RuntimeError(f"{type(error).__name__}: {error}")
            for note in getattr(error, "__notes__", ()):
                said.add_note(note)
            raise said from error
        raise


def _freeze() -> None:
    """Collect what a trial leaves behind, and let the garbage collector look no more at what stays.

    Else it looks at everything within some step of the next trial, at modules and compiled code, above all, which
    takes a tenth of a second and more.
    """
    gc.collect()
    gc.freeze()
