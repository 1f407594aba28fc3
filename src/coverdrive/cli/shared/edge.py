"""The edge of the command: however it ends, that becomes an exit status and, where something is wrong, one clear line.

`coverdrive --help` says what every status means.
"""

import errno
import json
import os
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cyclopts import CycloptsError
from pydantic_core import to_jsonable_python
from rich.text import Text

from coverdrive.cli.shared.interrupts import Stopped, heeded
from coverdrive.cli.shared.terminal import OutputClosed, Terminal, show_what_can_be_shown
from coverdrive.errors import CoverdriveError, blamed

_CLOSED_OUTPUT = 141

_REMEDIES = {
    errno.ENOSPC: "make room, or name a folder on another disk; finished trials of a study are kept",
    errno.EDQUOT: "make room, or name a folder on another disk; finished trials of a study are kept",
    errno.EACCES: "ask for the permission, or name another folder, or a copy of this one",
    errno.EPERM: "ask for the permission, or name another folder, or a copy of this one",
    errno.EROFS: "name a folder that you can write to, or a copy of this one there",
    errno.ENAMETOOLONG: "take a shorter name",
    errno.ENOTDIR: "a part of this path is a file; name another folder",
    errno.EMFILE: "allow more open files with `ulimit -n`, or take fewer --workers",
    errno.ENOMEM: "take fewer --workers, or a smaller study",
}
"""what to try, by what the system says"""

_REPORT = "this should not happen: please report it, with the lines above and the command that you called"


def status_of(work: Callable[[], Any], as_json: Callable[[], bool]) -> int:
    """Do the work of the command and say how it ended.

    Args:
        work: gives the result of the command.
        as_json: whether the result is wanted as JSON; known only when the work has begun.
    """
    show_what_can_be_shown()
    status, said = _tried(work, as_json)
    if said and as_json():
        with suppress(OSError, OutputClosed):
            print_json({"error": said})
    try:
        _print()
    except (OutputClosed, OSError):  # the rest is dropped, which Python would complain about at the very end
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return status or _CLOSED_OUTPUT
    return status


def _tried(work: Callable[[], Any], as_json: Callable[[], bool]) -> tuple[int, str]:
    """Exit status, and what went wrong."""
    try:
        with heeded():
            result = work()
            if as_json() and result is not None:
                print_json(result)
            _print()
    except OutputClosed:
        return _CLOSED_OUTPUT, ""
    except (CoverdriveError, CycloptsError) as error:
        return 2, _complain(str(error))
    except KeyboardInterrupt as stop:
        said = "; ".join(["stopped", *getattr(stop, "__notes__", [])])
        _say(said)
        return 128 + (stop.number if isinstance(stop, Stopped) else 2), said
    except Exception as error:
        return _failed(error)
    found: dict[str, Any] = result if isinstance(result, dict) else {}
    return 1 if found.get("missing") else 3 if found.get("undriven") else 0, ""


def _failed(error: Exception) -> tuple[int, str]:
    """The same of what the system, code of the user's or this package raised."""
    whose, said = blamed(error), f"{type(error).__name__}: {error}"
    if isinstance(error, OSError) and not whose:
        return 2, _complain(in_words(error))
    if isinstance(error, MemoryError) and not whose:
        return 2, _complain(f"not enough memory ({error}); take fewer --workers, or fewer or shorter recordings")
    with suppress(OSError):
        traceback.print_exception(error)
    if whose:
        return 2, _complain(f"{said}; {whose}")
    _complain(_REPORT)
    return 1, said


def in_words(error: OSError) -> str:
    """What the system said, about which file, and what to try."""
    files = [str(name) for name in (error.filename, error.filename2) if name is not None]
    what = error.strerror or str(error) or type(error).__name__
    said = ": ".join([*(" → ".join(files),) * bool(files), what])
    remedy = _REMEDIES.get(error.errno or 0)
    return f"{said}; {remedy}" if remedy else said


def print_json(result: Any) -> None:
    """Print a result as JSON that every parser reads; numbers that JSON does not know become null.

    Raises:
        OutputClosed: nobody reads it.
    """
    plain = to_jsonable_python(result, inf_nan_mode="null", fallback=str)
    _print(json.dumps(plain, indent=2) + "\n")


def _complain(text: str) -> str:
    _say(text, Text("error: ", style="bold red"))
    return text


def _say(line: str, before: Text | str = "") -> None:
    """One line on stderr, if there is anybody to read it."""
    with suppress(OSError, OutputClosed):
        Terminal(stderr=True, soft_wrap=True).print(Text.assemble(before, line), highlight=False)


def _print(text: str = "") -> None:
    """Write a text, and what is still in the buffer of stdout.

    Raises:
        OutputClosed: nobody reads it.
        OSError: the disk is full.
    """
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        raise OutputClosed from None
