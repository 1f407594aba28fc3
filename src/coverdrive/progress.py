"""Progress of long work: whoever does it says how far it is, and whoever wants to know listens.

    with stage("training"):
        for epoch in range(epochs):
            ...
            done(epoch + 1, epochs)

Nothing has to be handed down to the functions that do the work; without a listener nothing happens. What is listened to
belongs to the context (`contextvars`), so that threads do not disturb one another.
"""

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from typing import NamedTuple

Listener = Callable[[str, float], None]
"""is told the name of a stage and the share of it, in [0, 1], that is done; what it raises ends the work"""


class _Stage(NamedTuple):
    """The stage that is going on, and which share of it the work at hand is."""

    name: str
    begin: float
    end: float


_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)
_stage: ContextVar[_Stage | None] = ContextVar("stage", default=None)


@contextmanager
def heard_by(listener: Listener | None) -> Generator[None]:
    """Tell a listener how far the work within the block is, or nobody."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


@contextmanager
def _at(place: _Stage) -> Generator[None]:
    """Report the beginning of the work of the block, and its end if nothing was raised."""
    before = _stage.set(place)
    try:
        done(0)
        yield
        done(1)
    finally:
        _stage.reset(before)


def stage(name: str) -> AbstractContextManager[None]:
    """Begin a stage of the work, and report its end if nothing was raised."""
    return _at(_Stage(name, 0.0, 1.0))


def part(number: int, total: int) -> AbstractContextManager[None]:
    """Let what the block reports count as one of ``total`` equal parts of the stage; parts are numbered from 0."""
    whole = _stage.get()
    if whole is None:
        return nullcontext()
    width = (whole.end - whole.begin) / total
    return _at(_Stage(whole.name, whole.begin + number * width, whole.begin + (number + 1) * width))


def done(count: float, total: float = 1.0) -> None:
    """Report that ``count`` of ``total`` of the stage, or of its part, are done; nobody hears it outside a stage."""
    listener, at = _listener.get(), _stage.get()
    if listener is not None and at is not None:
        listener(at.name, at.begin + (at.end - at.begin) * count / total)
