"""Grids of settings: ``planner.problem.obstacles.order=2,4`` and the like, every combination one cell."""

import json
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from coverdrive.errors import SettingError

PARTS = ("planner", "episode", "traffic")
"""parts of an experiment that a study can vary; the others made the predictor"""


@dataclass(frozen=True)
class Cell:
    """One combination of values."""

    name: str
    """what differs, fit for the name of a folder"""
    changes: dict[str, Any]
    """the values as nested tables of an experiment"""


def cells_of(settings: Sequence[str]) -> list[Cell]:
    """Every combination of the values of some settings.

    Args:
        settings: each a dotted name, an equals sign, and values in TOML's notation with commas between them; text
            needs no quotes.

    Raises:
        SettingError: a setting is not of this form, or cannot differ between studies of one predictor.
    """
    axes = [[(name, value) for value in values] for name, values in map(_parsed, settings)]
    return [Cell(_name(cell), _nested(cell)) for cell in product(*axes)]


def _parsed(setting: str) -> tuple[str, list[Any]]:
    name, equals, text = setting.partition("=")
    if not equals or not text or name.split(".")[0] not in PARTS:
        raise SettingError(
            f"{setting!r} does not vary a study; expected a setting of {', '.join(PARTS)} with its values, as in "
            "planner.problem.obstacles.order=2,4"
        )
    try:
        return name, tomllib.loads(f"values = [{text}]")["values"]
    except tomllib.TOMLDecodeError:
        return name, [_value(part) for part in text.split(",")]


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _name(cell: Sequence[tuple[str, Any]]) -> str:
    texts = (f"{name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in cell)
    return re.sub(r"[^\w.,=+-]+", "_", ",".join(texts))


def _nested(cell: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for name, value in cell:
        *parts, last = name.split(".")
        inner = nested
        for part in parts:
            inner = inner.setdefault(part, {})
        inner[last] = value
    return nested
