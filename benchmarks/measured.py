"""Says measured numbers in README and docs: `{{ measured("dial-drivers.speed.0", ".1f") }}`.

Pages of the documentation call these macros (mkdocs-macros); a name that no file in `benchmarks/results/` has is an
error. README cannot: its part between two comments is `came_out.md`, filled in by `python benchmarks/measured.py`.
"""

import json
import math
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

FOLDER = Path(__file__).with_name("results")
TOLD, README = Path(__file__).with_name("came_out.md"), Path(__file__).parents[1] / "README.md"
PART = re.compile(r"(?<=<!-- came_out -->\n).*(?=<!-- /came_out -->)", re.DOTALL)


@cache
def kept(name: str) -> Mapping[str, Any]:
    """A file of `results.save`."""
    file = FOLDER / f"{name}.json"
    if not file.exists():
        there = ", ".join(sorted(each.stem for each in FOLDER.glob("*.json")))
        raise KeyError(f"no {file.name} in {FOLDER}: there are {there}")
    return json.loads(file.read_text(encoding="utf-8"))


def value(key: str) -> Any:
    """The value of ``file.name.name``, or with a number the part of an interval: 0 for itself, 1 and 2 for its ends."""
    name, *parts = key.split(".")
    found = kept(name)["values"]
    for part in parts:
        try:
            found = found[int(part)] if isinstance(found, list) else found[part]
        except (KeyError, IndexError, ValueError, TypeError):
            raise KeyError(f"{key}: no {part!r} in {found}") from None
    return found


def measured(key: str, form: str = "g") -> str:
    """A measured number with its interval, if it has one: 5.1 % (2.6–9.2), or with a sign −7.8 (−9.2 … −6.4).

    Args:
        key: see `value`.
        form: as of `format`; shares are ``.1%``, counts ``,``.
    """
    found = value(key)
    if found is None:
        return "–"
    if not isinstance(found, list):
        return _said(found, form)
    *itself, low, high = found
    ends = (_said(each, form).removesuffix(" %") for each in (low, high))
    interval = (" … " if "+" in form else "–").join(ends)
    return f"{_said(itself[0], form)} ({interval})" if itself else interval


def at_most(key: str, digits: int = 1) -> str:
    """A bound from above as a percentage, rounded up."""
    unit = 10.0**digits
    return f"{math.ceil(100 * unit * value(key) - 1e-9) / unit:.{digits}f} %"


def outcome(key: str) -> str:
    """Of one planner in a world of a league: contacts at its fault + others, mean speed, difference to the first."""
    apart = f" {measured(f'{key}.faster by', '+.1f').split(' ', 1)[1]}" if "faster by" in value(key) else ""
    return f"{value(f'{key}.own fault')}+{value(f'{key}.others')}, {measured(f'{key}.speed', '.1f')}{apart}"


def source(name: str) -> str:
    """By what a file was measured."""
    return "`{command}`, {date}, commit {commit}".format_map(kept(name))


MACROS = (measured, at_most, outcome, source, value)


def define_env(env: Any) -> None:
    """Give the macros to mkdocs-macros."""
    for each in MACROS:
        env.macro(each)


def filled(text: str) -> str:
    """A page with its macros called."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    environment.globals |= {each.__name__: each for each in MACROS}
    return environment.from_string(text).render()


def readme() -> str:
    """README with what is kept now."""
    told = filled(TOLD.read_text(encoding="utf-8"))
    return PART.sub(lambda _: f"\n{told.strip()}\n\n", README.read_text(encoding="utf-8"))


def _said(number: float, form: str) -> str:
    text = f"{100 * number:{form[:-1]}f} %" if form.endswith("%") else f"{number:{form}}"
    return text.replace("-", "−")


if __name__ == "__main__":
    README.write_text(readme(), encoding="utf-8")
