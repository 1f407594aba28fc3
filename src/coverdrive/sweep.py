"""Settings on the command line: ``planner.problem.obstacles.order=4``, or a sweep over several values, ``…=2,4``."""

import json
import re
import tomllib
from collections.abc import Sequence
from itertools import product
from typing import Any

from coverdrive.errors import SettingError

PARTS = ("planner", "episode", "traffic")
"""parts of an experiment that a study can vary; the others made the predictor"""


def changes_of(settings: Sequence[str]) -> dict[str, Any]:
    """The values of some settings as nested tables of an experiment; what stands last holds.

    Each is a dotted name, an equals sign and a value in TOML's notation, where text needs no quotes; what is not of
    this form is a `SettingError`.
    """
    return _nested([(name, _value(text)) for name, text in map(_split, settings)])


def sweep(settings: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Every combination of the values of some settings as nested tables of an experiment, by what differs.

    That is fit for the name of a folder. Settings are as of `changes_of`, with commas between their values; one that is
    named twice, or cannot differ between studies of one predictor, is a `SettingError`, too.
    """
    parsed = [_split(setting) for setting in settings]
    names = [name for name, _ in parsed]
    for name in names:
        if name.split(".")[0] not in PARTS:
            raise SettingError(
                f"{name} cannot vary between studies of one predictor; expected a setting of {', '.join(PARTS)}"
            )
        if names.count(name) > 1:
            raise SettingError(f"{name} is named twice; write its values once, with commas between them")
    axes = [[(name, value) for value in _values(text)] for name, text in parsed]
    return {_name(values): _nested(values) for values in product(*axes)}


def _split(setting: str) -> tuple[str, str]:
    name, equals, text = setting.partition("=")
    if not equals or not text.strip() or not re.fullmatch(r"\w+(\.\w+)*", name.strip()):
        raise SettingError(
            f"{setting!r} is no setting with its value; expected something like planner.problem.obstacles.order=4, "
            "with names as in the config.toml of any result"
        )
    return name.strip(), text.strip()


def _values(text: str) -> list[Any]:
    found = _value(f"[{text}]")
    return found if isinstance(found, list) else [_value(part) for part in text.split(",")]


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def _name(values: Sequence[tuple[str, Any]]) -> str:
    texts = (f"{name}={value if isinstance(value, str) else json.dumps(value, default=str)}" for name, value in values)
    return re.sub(r"[^\w.,=+-]+", "_", ",".join(texts))


def _nested(values: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for name, value in values:
        *parts, last = name.split(".")
        inner = nested
        for part in parts:
            if not isinstance(inner.setdefault(part, {}), dict):
                raise SettingError(f"{name} is a part of a setting that has a value of its own; leave one of them out")
            inner = inner[part]
        inner[last] = value
    return nested
