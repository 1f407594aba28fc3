"""What was measured, kept: a file of named values for each benchmark, and tables in `benchmarks/RESULTS.md`.

`benchmarks/results/NAME.json` has the command that wrote it, the commit, the version, the day, the seed, and values: a
number, or a number with the ends of its 95 % interval. README and docs say no measured number that is not in such a
file (`measured.py`).
"""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from coverdrive import __version__

FOLDER = Path(__file__).with_name("results")
FILE = Path(__file__).with_name("RESULTS.md")
HEAD = "# Measured\n\nWritten by the commands that stand in each section; what documentation says is so stands there.\n"


def save(name: str, values: Mapping[str, Any], seed: int | None = None, **known: str) -> Path:
    """Write the values of a benchmark, and print what has changed since the last time.

    Args:
        name: of the file.
        values: by name, nested at will: numbers, texts, or lists of a number and the ends of its interval.
        seed: of what was measured.
        known: ``command``, ``commit``, ``date`` and ``version``, where they are not those of now.
    """
    file, about = FOLDER / f"{name}.json", {"command": _command(), "commit": _commit(), "date": _today()}
    before = json.loads(file.read_text(encoding="utf-8"))["values"] if file.exists() else {}
    whole = about | {"version": __version__} | known | {"seed": seed, "values": _rounded(values)}
    file.parent.mkdir(exist_ok=True)
    file.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    for line in changes(before, whole["values"]):
        print(f"{name}: {line}")
    return file


def changes(before: Any, now: Any) -> Iterator[str]:
    """A line for each number that differs: old, new, and their ratio."""
    old = dict(_numbers(before))
    for key, value in _numbers(now):
        if key in old and old[key] != value:
            ratio = f" ({value / old[key]:.3f} times)" if old[key] else ""
            yield f"{key} {old[key]:g} → {value:g}{ratio}"


def _numbers(values: Any, key: str = "") -> Iterator[tuple[str, float]]:
    """All numbers of nested values by their names, as `measured` takes them."""
    if isinstance(values, int | float) and not isinstance(values, bool):
        yield key, values
    elif isinstance(values, dict | list):
        for name, value in values.items() if isinstance(values, dict) else enumerate(values):
            yield from _numbers(value, f"{key}.{name}".lstrip("."))


def _rounded(values: Any) -> Any:
    """With six significant digits, more than anybody reads."""
    if isinstance(values, float):
        return float(f"{values:.6g}")
    if isinstance(values, Mapping):
        return {name: _rounded(value) for name, value in values.items()}
    return [_rounded(value) for value in values] if isinstance(values, list | tuple) else values


def write_section(title: str, about: str | None, body: str) -> None:
    """Write a section of `RESULTS.md` in place of the one of the same title, or at the end."""
    said = " ".join((about or "").split("`.", 1)[-1].split())
    text = f"## {title}\n\n{said}\n\n`{_command()}`, {_today()}, after {_commit()}.\n{body}\n"
    whole = FILE.read_text(encoding="utf-8") if FILE.exists() else HEAD
    section = re.compile(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
    whole = section.sub(lambda _: text, whole) if section.search(whole) else f"{whole}\n{text}"
    FILE.write_text(re.sub(r"\n{3,}", "\n\n", whole), encoding="utf-8")


def _command() -> str:
    return shlex.join(["python", f"benchmarks/{Path(sys.argv[0]).name}", *map(_shown, sys.argv[1:])])


def _commit() -> str:
    said = ["git", "rev-parse", "--short", "HEAD"]
    return subprocess.run(said, cwd=FILE.parent, capture_output=True, text=True, check=False).stdout.strip()


def _today() -> str:
    return f"{datetime.now(UTC):%Y-%m-%d}"


def _shown(argument: str) -> str:
    """An argument without the folders that are somebody's own."""
    path = Path(argument)
    return f"{path.name}/" if path.is_dir() else path.name if path.exists() else argument
