"""Compilation of the planner in a process of its own, while this one has something else to do.

Whoever needs the code by then waits for it (`coverdrive.wholes`); if that process came to nothing, it compiles it.
"""

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager

from coverdrive.simulation.studies.orphans import end_with_parent

_CODE = "import sys; from coverdrive.simulation.studies.ahead import compile_for; compile_for(int(sys.argv[1]))"


@contextmanager
def compiled_ahead() -> Generator[None]:
    """Have what a planner needs compiled during the block, as far as it is not; the process ends with it."""
    loaded = sys.modules.get("coverdrive.planning.solver.search")  # else it is that process that looks
    if (loaded and loaded.is_compiled()) or (os.cpu_count() or 1) < 2:
        yield
        return
    command = [sys.executable, "-P", "-c", _CODE, str(os.getpid())]
    nothing = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=True)
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def compile_for(parent: int) -> None:
    """Compile in this process, which ends with the one of that number."""
    end_with_parent(parent)
    from coverdrive.planning.planner import MpcPlanner

    MpcPlanner().reset(0.1)
