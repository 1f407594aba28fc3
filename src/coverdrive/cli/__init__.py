"""The command ``coverdrive``; each subcommand loads what it needs when it is called."""

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any

from cyclopts import App, Group, Parameter

from coverdrive._version import __version__
from coverdrive.cli.shared.bars import console as progress_console
from coverdrive.cli.shared.edge import status_of
from coverdrive.cli.shared.options import console
from coverdrive.cli.shared.terminal import Terminal

app = App(
    name="coverdrive",
    version=__version__,
    result_action="return_value",
    default_parameter=Parameter(negative_bool=(), negative_iterable=(), json_list=False, json_dict=False),
    suppress_keyboard_interrupt=False,
    exit_on_error=False,
    print_error=False,
    console=Terminal(),
    help="""Certified manoeuvre sets from recorded highway traffic, and planning against every member of them.

    Start with `coverdrive run`: it learns a predictor, certifies how often it misses, and drives a closed-loop study,
    in generated traffic if no recording is given. Every result is written to one folder, and `report.html` in it shows
    all of them.""",
    help_epilogue="""Exit status: 0, done · 1, an error in the program, or `doctor` found something missing · 2,
    something that you can put right: an argument, a setting, a file, a disk, code of yours, a claim that the data do
    not support · 3, done, but `solve` could not read or drive some problems · 130, stopped by Ctrl-C · 143, stopped by
    SIGTERM · 141, nobody reads the output any more.""",
)
_COMMANDS = {
    "demo": "demo", "run": "run", "inspect": "learning.inspect", "fit": "learning.fit",
    "calibrations": "learning.calibrations", "dial": "driving.dial", "study": "driving.study", "drive": "driving.study",
    "compare": "driving.study", "league": "driving.league", "rare": "driving.rare", "report": "showing",
    "figures": "showing", "animate": "showing", "solve": "driving.solve", "basis": "learning.basis", "paper": "paper",
    "doctor": "doctor",
}  # fmt: skip
"""in the order of a first visit, and the file of each"""

for number, (name, file) in enumerate(_COMMANDS.items()):
    app.command(getattr(import_module(f"coverdrive.cli.{file}"), name), sort_key=number)

app.meta.group_parameters = Group("Options of every command")
app.meta.suppress_keyboard_interrupt = False


@app.meta.default
def launch(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    quiet: Annotated[bool, Parameter(help="Print nothing but errors.")] = False,
    json: Annotated[bool, Parameter(help="Print the result as JSON, an error too, and all else to stderr.")] = False,
) -> Any:
    """Run a command with its output where it is wanted."""
    console.stderr = json
    console.quiet = progress_console.quiet = quiet
    return app(tokens)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command and leave with its exit status.

    Args:
        arguments: of the command; without any, those that the process was started with.
    """
    console.stderr = console.quiet = progress_console.quiet = False
    given = () if arguments is None else (list(arguments),)
    status = status_of(lambda: app.meta(*given), lambda: console.stderr)
    if arguments is None and (workers := sys.modules.get("coverdrive.simulation.studies.workers")):
        workers.end_processes()
    sys.exit(status)
