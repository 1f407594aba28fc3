"""The command as a user calls it."""

import io
import json
import os
import subprocess
import sys
import warnings
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Literal

import pytest

from coverdrive import cli
from coverdrive.cli.shared.bars import console as progress_console
from coverdrive.cli.shared.options import console
from documented_keys import documented_keys

WIDTH = 200
"""[characters] of the terminal"""


def coverdrive(*arguments: str | Path, status: int = 0, only: Literal["stdout", "stderr"] | None = None) -> str:
    """Call the command in this process and return what it printed, JSON with the keys that are documented; an error in
    the program is raised.
    """
    printed, complained = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed), redirect_stderr(complained):
        patch.setattr(sys, "argv", ["coverdrive", *map(str, arguments)])
        patch.setenv("COLUMNS", str(WIDTH))
        for each in (console, progress_console):
            patch.setattr(each, "_width", WIDTH)
        ended = status_of_main()
    if ended == 0 and "--json" in arguments:
        command = next(str(each) for each in arguments if not str(each).startswith("-"))
        assert set(json.loads(printed.getvalue())) in documented_keys()[command]
    return checked(ended, status, printed.getvalue(), complained.getvalue(), only)


def coverdrive_alone(*arguments: str | Path, status: int = 0, only: Literal["stdout", "stderr"] | None = None) -> str:
    """The same in a process of its own, where warnings are errors."""
    result = subprocess.run(
        [sys.executable, "-m", "coverdrive", *map(str, arguments)], capture_output=True, text=True, check=False,
        timeout=600, env={
            "PATH": "/usr/bin:/bin", "COLUMNS": str(WIDTH), "PYTHONWARNINGS": "error", "JAX_PLATFORMS": "cpu",
            "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
        },
    )  # fmt: skip
    return checked(result.returncode, status, result.stdout, result.stderr, only)


def status_of_main() -> int:
    """The exit status of the command with the arguments of this process."""
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Cyclopts application invoked without tokens")  # they are in `sys.argv`
            cli.main()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return 0


def checked(ended: int, status: int, printed: str, complained: str, only: str | None) -> str:
    """The output, if the command ended as expected; a hint of a traceback is a failure whatever the status."""
    assert ended == status, complained
    assert "Traceback" not in complained
    return {"stdout": printed, "stderr": complained, None: printed + complained}[only]
