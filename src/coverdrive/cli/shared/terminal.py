"""What the command prints on: nothing in a name is markup, and what a terminal cannot show is replaced."""

import sys
from io import TextIOWrapper

from rich.console import Console


class OutputClosed(Exception):
    """Whoever read the output has gone, as ``head`` does."""


class Terminal(Console):
    """A console that prints text as it is."""

    def __init__(self, *, stderr: bool = False, soft_wrap: bool = False):
        """Print to stdout, or to stderr; with ``soft_wrap`` lines are as long as they are."""
        super().__init__(stderr=stderr, soft_wrap=soft_wrap, markup=False, emoji=False)

    def on_broken_pipe(self) -> None:
        """Let the edge of the command end it."""
        raise OutputClosed


def show_what_can_be_shown() -> None:
    """Let stdout and stderr replace the characters that they cannot encode."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
