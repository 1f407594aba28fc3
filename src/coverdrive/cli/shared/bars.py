"""Progress in the terminal: bars with the time left, one line for each stage, or a sign of life. It goes to stderr."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial

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


def report(bars: Progress, stage: str, share: float) -> None:
    """Say that a share in [0, 1] of a stage is done, whose bar pulses until the first share is.

    Raises:
        Stopped: somebody interrupted since the bars are shown, even if the exception was lost then.
    """
    interrupts.again()
    tasks = {task.description: task.id for task in bars.tasks}
    task = tasks[stage] if stage in tasks else bars.add_task(stage, total=None)
    bars.update(task, completed=share, total=1.0 if share > 0 else None)


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
def stages(kept: str = "") -> Generator[None]:
    """Show a bar for each stage of the work in the block; who stops it is told what is ``kept``, if anything is."""
    try:
        with interrupts.heeded(), display() as bars, heard_by(partial(report, bars)):
            yield
    except KeyboardInterrupt as stop:
        if kept:
            stop.add_note(f"{kept} are kept, and the same command goes on from them")
        raise


@contextmanager
def waiting(task: str = "loading") -> Generator[None]:
    """Show that something goes on while the block runs, where nobody knows how long it takes."""
    with console.status(Text(task)):
        yield
