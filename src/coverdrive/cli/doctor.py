"""``coverdrive doctor``: what is installed, and what is missing."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from coverdrive.cli.shared.bars import stages
from coverdrive.cli.shared.options import Folder, console


def doctor(folder: Folder = Path("results")) -> dict[str, Any]:
    """Say what is installed and what is missing: packages, extras, video, a place to write; with hints.

    The exit status is 1 if something is missing that the commands need.

    For example:

    - after an installation: `coverdrive doctor`
    - for results in another folder: `coverdrive doctor us101`
    """
    from rich.box import SIMPLE_HEAD
    from rich.text import Text

    from coverdrive.doctor import examine
    from coverdrive.reporting.tables.fitting import FittingTable

    with stages():
        findings = examine(folder)
    table = FittingTable(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name in ("what", "found"):
        table.add_column(name, overflow="fold")
    for finding in findings:
        mark = ("✓", "green") if finding.fine else ("✗", "red") if finding.needed else ("–", "yellow")
        table.add_row(Text.assemble(mark, " ", finding.name), Text(finding.found))
        if not finding.fine:
            table.add_row("", Text(finding.hint, style="dim"))
    console.print(table)
    missing = [finding.name for finding in findings if finding.needed and not finding.fine]
    console.print("Everything that the commands need is there." if not missing else f"Missing: {', '.join(missing)}.")
    return {"missing": missing, "findings": [asdict(finding) for finding in findings]}
