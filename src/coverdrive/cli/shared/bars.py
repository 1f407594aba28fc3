"""Progress in the terminal: bars with the time left, one line for each stage, or a sign of life. It goes to stderr."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from coverdrive.cli.shared import interrupts
from coverdrive.cli.shared.terminal import Terminal
from coverdrive.progress import heard_by

_MEMORY = 3600.0
"""[s] that the speed of a stage is averaged over; its steps may be minutes apart"""

console = Terminal(stderr=True)
"""of the bars; may be made quiet"""


class Stages:
    """Bars that appear as their stages begin, and pulse until the first share of them is done."""

    def __init__(self, bars: Progress):
        """Draw on the given display."""
        self._bars = bars
        self._tasks = {task.description: task.id for task in bars.tasks}

    def report(self, stage: str, share: float) -> None:
        """Say that a share in [0, 1] of a stage is done.

        Raises:
            Stopped: somebody interrupted since the bars are shown, even if the exception was lost then.
        """
        interrupts.again()
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=None)  # pulses
        self._bars.update(self._tasks[stage], completed=share, total=1.0 if share > 0 else None)


def display(clock: Callable[[], float] | None = None) -> Progress:
    """What the bars look like; they take the time from a clock in seconds."""
    columns = (
        TextColumn("{task.description}", markup=False, table_column=Column(overflow="fold")),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=console, disable=console.quiet, speed_estimate_period=_MEMORY, get_time=clock)


@contextmanager
def stages() -> Generator[None]:
    """Show a bar for each stage of the work in the block."""
    with interrupts.heeded(), display() as bars, heard_by(Stages(bars).report):
        yield


@contextmanager
def waiting(task: str = "loading") -> Generator[None]:
    """Show that something goes on while the block runs, where nobody knows how long it takes."""
    with console.status(Text(task)):
        yield
