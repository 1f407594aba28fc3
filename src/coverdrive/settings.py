"""The base of every settings model: frozen, finite, and unknown keys are errors; and how settings are written.

Each part of the package owns one such model; `coverdrive.config` puts them together into one experiment. Every number
has bounds, far outside of what makes sense and far inside of what breaks arithmetic or memory.
"""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, cast

import tomli_w
from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from coverdrive.errors import SettingError

_WIDTH = 110
"""of the comments in a file"""


class Settings(BaseModel):
    """Immutable settings with the paper's constants as defaults."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False)


def _in_order(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError("the first of the two must not be more than the second")
    return pair


InOrder = AfterValidator(_in_order)
"""of a pair of settings, the smaller one first"""


S = TypeVar("S", bound=Settings)


def checked(kind: type[S], values: Mapping[str, Any]) -> S:
    """Settings of a kind with these values; a SettingError says which is wrong, why, and what it was."""
    try:
        settings = kind.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        names = [str(each) for each in first["loc"] if isinstance(each, int) or each.isidentifier()]  # no kinds
        place, got = ".".join(names) or "the settings as a whole", repr(first["input"])
        said = "" if isinstance(first["input"], (dict, Settings)) else f", got {textwrap.shorten(got, 60)}"
        raise SettingError(f"{place}: {first['msg']}{said}") from error
    for place, value in _taken_for_numbers(settings, values):
        raise SettingError(f"{place}: Input should be a valid number, got {value}")
    return settings


def _taken_for_numbers(settings: Settings, values: Mapping[str, Any]) -> Iterator[tuple[str, bool]]:
    """Truth values, and where they are, that pydantic took for 0 or 1."""
    for name, value in values.items():
        own = getattr(settings, name, None)
        if isinstance(own, Settings) and isinstance(value, Mapping):
            inner = _taken_for_numbers(own, cast(Mapping[str, Any], value))
            yield from ((f"{name}.{place}", truth) for place, truth in inner)
        pairs = zip(value, own, strict=False) if isinstance(value, list | tuple) and isinstance(own, tuple) else []
        for number, (one, taken) in enumerate([(value, own), *pairs]):
            if isinstance(one, bool) and not isinstance(taken, bool):
                yield name + f".{number - 1}" * (number > 0), one


def merged(values: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Nested tables with others put over them; None changes nothing, and another ``kind`` begins a table anew."""
    result = dict(values)
    for name, change in changes.items():
        if isinstance(change, dict):
            part, new = values.get(name), cast(dict[str, Any], change)
            if not isinstance(part, dict) or new.get("kind") not in (None, part.get("kind")):
                part = {}  # settings of another kind
            result[name] = merged(cast(dict[str, Any], part), new)
        elif change is not None:
            result[name] = change
    return result


def to_toml(settings: Settings) -> str:
    """Settings as TOML: one table for each part, above every key what it means and its unit."""
    return "\n".join(_table(settings, "")).lstrip("\n") + "\n"


def _table(settings: Settings, name: str) -> Iterator[str]:
    """Lines of a table, of its keys first, because TOML takes what follows a table's head for a part of it."""
    values = settings.model_dump(mode="json", exclude_none=True)
    parts: dict[str, tuple[Settings, str]] = {}
    for key, field in type(settings).model_fields.items():
        value: Any = getattr(settings, key)
        if isinstance(value, Settings):
            parts[key] = (value, field.description or "")
            continue
        yield from _comment(field.description)
        yield f"{key} = {_literal(values[key])}" if key in values else f"# {key} is not set"
    for key, (part, description) in parts.items():
        inner = f"{name}.{key}" if name else key
        yield ""
        yield from _comment(description or type(part).__doc__)
        yield f"[{inner}]"
        yield from _table(part, inner)


def _literal(value: Any) -> str:
    """A value as TOML writes it, a list in one line."""
    if isinstance(value, list):
        return f"[{', '.join(map(_literal, cast(list[Any], value)))}]"
    return tomli_w.dumps({"value": value}).partition(" = ")[2].rstrip("\n")


def _comment(text: str | None) -> list[str]:
    return textwrap.wrap(" ".join((text or "").split()), _WIDTH, initial_indent="# ", subsequent_indent="# ")
