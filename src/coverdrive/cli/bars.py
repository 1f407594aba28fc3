"""Progress in the terminal: bars with the time left, one line for each stage, or a sign of life. It goes to stderr."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

_MEMORY = 3600.0
"""[s] that the speed of a stage is averaged over; its steps may be minutes apart"""

console = Console(stderr=True)
"""of the bars; may be made quiet"""


class Stages:
    """Bars that appear as their stages begin, and pulse until the first share of them is done."""

    def __init__(self, bars: Progress, interrupted: threading.Event):
        """Draw on the given display until somebody interrupts."""
        self._bars = bars
        self._interrupted = interrupted
        self._tasks = {task.description: task.id for task in bars.tasks}

    def report(self, stage: str, share: float) -> None:
        """Say that a share in [0, 1] of a stage is done.

        Raises:
            KeyboardInterrupt: somebody interrupted since the bars are shown, even if the exception was lost then.
        """
        if self._interrupted.is_set():
            raise KeyboardInterrupt
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=None)  # pulses
        self._bars.update(self._tasks[stage], completed=share, total=1.0 if share > 0 else None)

    def share(self, stage: str) -> Callable[[float], None]:
        """A callback for one stage that takes the share that is done."""
        return lambda share: self.report(stage, share)

    def count(self, stage: str) -> Callable[[int, int], None]:
        """A callback for one stage that takes how many of how many are done."""
        return lambda done, total: self.report(f"{stage} ({total})", done / total)


def display(clock: Callable[[], float] | None = None) -> Progress:
    """What the bars look like; they take the time from a clock in seconds."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=console, disable=console.quiet, speed_estimate_period=_MEMORY, get_time=clock)


@contextmanager
def stages() -> Generator[Stages]:
    """Show bars while the block runs."""
    with _interrupts() as interrupted, display() as bars:
        yield Stages(bars, interrupted)


@contextmanager
def waiting(task: str = "loading") -> Generator[None]:
    """Show that something goes on while the block runs, where nobody knows how long it takes."""
    with console.status(task):
        yield


@contextmanager
def _interrupts() -> Generator[threading.Event]:
    """Remember an interrupt: Python drops an exception that is raised in a callback of the garbage collector."""
    interrupted = threading.Event()

    def interrupt(number: int, frame: FrameType | None) -> None:
        interrupted.set()
        signal.default_int_handler(number, frame)

    in_charge = threading.current_thread() is threading.main_thread()
    if not in_charge or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield interrupted
        return
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
