"""Progress bars in the terminal, with the time left; one line for each stage. They go to stderr."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

console = Console(stderr=True)
"""of the bars; may be made quiet"""


class Stages:
    """Bars that appear as their stages begin."""

    def __init__(self, bars: Progress):
        """Draw on the given display."""
        self._bars = bars
        self._tasks = {task.description: task.id for task in bars.tasks}

    def report(self, stage: str, share: float) -> None:
        """Say that a share in [0, 1] of a stage is done."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=1.0)
        self._bars.update(self._tasks[stage], completed=share)

    def share(self, stage: str) -> Callable[[float], None]:
        """A callback for one stage that takes the share that is done."""
        return lambda share: self.report(stage, share)

    def count(self, stage: str) -> Callable[[int, int], None]:
        """A callback for one stage that takes how many of how many are done."""
        return lambda done, total: self.report(f"{stage} ({total})", done / total)


@contextmanager
def stages() -> Generator[Stages]:
    """Show bars while the block runs."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=console.quiet) as bars:
        yield Stages(bars)
