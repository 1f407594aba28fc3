"""Worker processes end when the process that started them is gone, however it ended.

Nobody tells a worker that its parent was killed: it would wait for its next trial for minutes. This module is all
that a worker loads before it watches.
"""

import os
import threading
import time

_PAUSE = 0.5
"""[s] between two looks"""


def begin_worker(parent: int) -> None:
    """Begin a worker of a process of this number, on one thread for XLA, which reads NPROC before its first work."""
    os.environ["NPROC"] = "1"
    end_with_parent(parent)


def end_with_parent(parent: int) -> None:
    """Let this process end within a second of its parent, a process of this number, which may be gone by now."""
    threading.Thread(target=_watch, args=(parent,), daemon=True, name="watches the parent").start()


def _watch(parent: int) -> None:
    """An orphan is given another parent by the system."""
    while os.getppid() == parent:
        time.sleep(_PAUSE)
    os._exit(1)
