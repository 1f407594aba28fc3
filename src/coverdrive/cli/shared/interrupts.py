"""Being stopped: by Ctrl-C (SIGINT) or, as a system does it, by SIGTERM; both end the work in the same way.

Python drops an exception that is raised in a callback of the garbage collector, and complains. A signal that comes
there is therefore only remembered, and the next report of progress raises it.
"""

import gc
import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

_USUAL = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
"""what is replaced; a handler of somebody else's stays, and so does a signal that is ignored"""

_stopped: list[int] = []
"""number of the signal that came since signals are heeded, if one did"""


class Stopped(KeyboardInterrupt):
    """Somebody wants the command to end."""

    def __init__(self, number: int):
        """By this signal."""
        super().__init__()
        self.number = number


@contextmanager
def heeded() -> Generator[None]:
    """Raise `Stopped` in the block when a signal asks for it; within another such block nothing changes.

    Raises:
        Stopped: a signal came.
    """
    mine = threading.current_thread() is threading.main_thread()
    replaced = [number for number, usual in _USUAL.items() if mine and signal.getsignal(number) is usual]
    for number in replaced:
        signal.signal(number, _stop)
    try:
        yield
    finally:
        for number in replaced:
            signal.signal(number, _USUAL[number])
        if replaced:
            _stopped.clear()


def again() -> None:
    """Raise `Stopped` if a signal came before, even if that exception was lost.

    Raises:
        Stopped: a signal came.
    """
    if _stopped:
        raise Stopped(_stopped[0])


def _stop(number: int, frame: FrameType | None) -> None:
    _stopped[:] = [number]
    collecting = [getattr(callback, "__code__", None) for callback in gc.callbacks]
    if frame is None or frame.f_code not in collecting:
        raise Stopped(number)
