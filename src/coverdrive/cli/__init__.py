"""The command ``coverdrive``, one file for each subcommand; each loads what it needs when it is called."""

import sys

from cyclopts import App
from rich.console import Console

from coverdrive import __version__
from coverdrive.cli.basis import basis
from coverdrive.cli.certify import certify
from coverdrive.cli.compare import compare
from coverdrive.cli.drive import drive
from coverdrive.cli.fit import fit
from coverdrive.cli.inspect import inspect
from coverdrive.cli.paper import paper
from coverdrive.cli.run import run
from coverdrive.cli.study import study
from coverdrive.errors import CoverdriveError

app = App(
    name="coverdrive",
    version=__version__,
    help="""Certified manoeuvre sets from recorded highway traffic, and planning against every member of them.

    Start with `coverdrive run`: it learns a predictor, certifies how often it misses, and drives a closed-loop study,
    in generated traffic if no recording is given. Every result is written to one folder.""",
)
for command in (run, fit, certify, paper, basis, study, compare, drive, inspect):
    app.command(command)


def main() -> None:
    """Run the command; errors that a user can put right are printed without a traceback."""
    complaints = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        app()
    except CoverdriveError as error:
        complaints.print("error:", style="bold red", end=" ")
        complaints.print(str(error), markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        complaints.print("stopped; finished trials are kept, and the same command goes on from them")
        sys.exit(130)
