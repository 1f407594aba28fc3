"""Puts what a benchmark measured into `benchmarks/RESULTS.md`, one section a benchmark, with its command and commit."""

import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

FILE = Path(__file__).with_name("RESULTS.md")
HEAD = "# Measured\n\nWritten by the commands that stand in each section; what documentation says is so stands there.\n"


def write_section(title: str, about: str | None, body: str) -> None:
    """Write a section in place of the one of the same title, or at the end."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=FILE.parent, capture_output=True, text=True, check=False
    ).stdout.strip()
    command = " ".join(["python", f"benchmarks/{Path(sys.argv[0]).name}", *map(_shown, sys.argv[1:])])
    said = " ".join((about or "").split("`.", 1)[-1].split())
    text = f"## {title}\n\n{said}\n\n`{command}`, {datetime.now(UTC):%Y-%m-%d}, after {commit}.\n{body}\n"
    whole = FILE.read_text(encoding="utf-8") if FILE.exists() else HEAD
    section = re.compile(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
    whole = section.sub(lambda _: text, whole) if section.search(whole) else f"{whole}\n{text}"
    FILE.write_text(re.sub(r"\n{3,}", "\n\n", whole), encoding="utf-8")


def _shown(argument: str) -> str:
    """An argument without the folders that are somebody's own."""
    path = Path(argument)
    return f"{path.name}/" if path.is_dir() else path.name if path.exists() else argument
