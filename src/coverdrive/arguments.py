"""Arguments of public calls, which may be anything: what was expected and what was got, as a `SettingError`."""

import math
import operator
import os
import reprlib
from collections.abc import Iterable
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from coverdrive.errors import SettingError

_SHOWN = (str, int, float, tuple, list, dict, np.ndarray, np.generic, type(None))
"""kinds of values that are written out; others may be huge"""


def whole(name: str, value: Any, least: int = 0, most: int | None = None) -> int:
    """A whole number of Python's or NumPy's from ``least`` to ``most``."""
    try:
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or number < least or (most is not None and number > most):
        bounds = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise SettingError(f"{name}: expected a whole number {bounds}, got {shown(value)}")
    return number


def wholes(name: str, values: Any, least: int = 0, most: int | None = None) -> tuple[int, ...]:
    """At least one such number, from a single one or from several."""
    numbers = tuple(whole(name, each, least, most) for each in _several(values, str))
    if not numbers:
        raise SettingError(f"{name}: expected at least one whole number, got {shown(values)}")
    return numbers


def finite(name: str, value: Any) -> float:
    """A finite number of Python's or NumPy's."""
    try:
        fine = not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
    except OverflowError:  # of whole numbers
        fine = False
    if not fine:
        raise SettingError(f"{name}: expected a number, got {shown(value)}")
    return float(value)


def period_of(value: Any) -> float:
    """[s] from one plan to the next: at least a millisecond, and at most a second."""
    if not 0.001 <= finite("period", value) <= 1:
        raise SettingError(f"the period between two steps is {value} s; expected at least 0.001 and at most 1 s")
    return float(value)


def path_of(name: str, value: Any, others: str = "") -> Path:
    """A path, given as such or by its name; ``others`` are what is taken, too, in words."""
    return Path(of_kind(name, value, (str, os.PathLike), f"{others}a path"))


def paths_of(name: str, values: Any) -> tuple[Path, ...]:
    """A single such path, or several."""
    return tuple(path_of(name, each) for each in _several(values, (str, bytes, os.PathLike)))


def of_kind(name: str, value: Any, kind: Any, expected: str) -> Any:
    """The value, if it is an object of a kind, or of one of several, that are ``expected`` in words."""
    if not isinstance(value, kind) or isinstance(value, type):
        raise SettingError(f"{name}: expected {expected}, got {shown(value)}")
    return value


def all_of(name: str, values: Any, kind: type, expected: str) -> tuple[Any, ...]:
    """A single value of a kind, or several, as a tuple."""
    return tuple(of_kind(name, each, kind, expected) for each in _several(values, (str, kind)))


def shown(value: Any) -> str:
    """What was given, in short."""
    try:
        if isinstance(value, type):
            return f"the class {value.__name__}"
        return reprlib.repr(value) if isinstance(value, _SHOWN) else f"an object of {type(value).__name__}"
    except ValueError:
        return "a number of too many digits"


def _several(values: Any, single: Any) -> Iterable[Any]:
    """The values of a collection; anything else, an array without axes, and what is ``single``, is one."""
    many = isinstance(values, Iterable) and getattr(values, "ndim", 1) and not isinstance(values, single)
    return values if many else [values]
