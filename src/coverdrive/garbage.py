"""When Python does not look for garbage that holds itself."""

import gc
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def not_looking_for_garbage() -> Generator[None]:
    """Let no time go into it while much is made that is needed to the end."""
    looking = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if looking:
            gc.enable()
