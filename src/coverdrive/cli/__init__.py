"""The command ``coverdrive``, one file for each subcommand; each loads what it needs when it is called."""

import json
import sys
from typing import Annotated, Any

from cyclopts import App, Group, Parameter
from rich.console import Console

from coverdrive import __version__
from coverdrive.cli.animate import animate
from coverdrive.cli.bars import console as progress_console
from coverdrive.cli.basis import basis
from coverdrive.cli.certify import certify
from coverdrive.cli.compare import compare
from coverdrive.cli.doctor import doctor
from coverdrive.cli.drive import drive
from coverdrive.cli.figures import figures
from coverdrive.cli.fit import fit
from coverdrive.cli.inspect import inspect
from coverdrive.cli.options import console
from coverdrive.cli.paper import paper
from coverdrive.cli.report import report
from coverdrive.cli.run import run
from coverdrive.cli.study import study
from coverdrive.errors import CoverdriveError

app = App(
    name="coverdrive",
    version=__version__,
    result_action="return_value",
    default_parameter=Parameter(negative_iterable=()),
    suppress_keyboard_interrupt=False,
    help="""Certified manoeuvre sets from recorded highway traffic, and planning against every member of them.

    Start with `coverdrive run`: it learns a predictor, certifies how often it misses, and drives a closed-loop study,
    in generated traffic if no recording is given. Every result is written to one folder, and `report.html` in it shows
    all of them.""",
    help_epilogue="""Exit status: 0, done · 1, an error in the program, or `doctor` found something missing · 2,
    something that you can put right: an argument, a setting, a file, a claim that the data do not support · 130,
    stopped.""",
)
_COMMANDS = (run, inspect, fit, certify, study, drive, compare, report, figures, animate, basis, paper, doctor)
"""in the order of a first visit"""

for number, command in enumerate(_COMMANDS):
    app.command(command, sort_key=number)

app.meta.group_parameters = Group("Options of every command")
app.meta.suppress_keyboard_interrupt = False


@app.meta.default
def launch(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    quiet: Annotated[bool, Parameter(negative="", help="Print nothing but errors.")] = False,
    json_: Annotated[
        bool, Parameter(name="--json", negative="", help="Print the result as JSON, and all else to stderr.")
    ] = False,
) -> Any:
    """Run a command with its output where it is wanted."""
    console.stderr = json_
    console.quiet = progress_console.quiet = quiet
    result = app(tokens)
    if json_ and result is not None:
        print(json.dumps(_plain(result), indent=2))
    return result


def main() -> None:
    """Run the command; errors that a user can put right are printed without a traceback."""
    complaints = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        result = app.meta()
    except CoverdriveError as error:
        complaints.print("error:", style="bold red", end=" ")
        complaints.print(str(error), markup=False)
        sys.exit(2)
    except KeyboardInterrupt as stop:
        complaints.print("; ".join(["stopped", *getattr(stop, "__notes__", [])]), markup=False)
        sys.exit(130)
    sys.exit(1 if result is not None and result.get("missing") else 0)


def _plain(value: Any) -> Any:
    """JSON values; numbers that JSON does not know become null."""
    if isinstance(value, dict):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not (-float("inf") < value < float("inf")):
        return None
    return value
