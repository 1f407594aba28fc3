"""Types and shapes of arguments and results, checked at every call of the package.

Jaxtyping's own decorator takes 50 µs a call, as it binds the arguments anew for its messages. Here beartype checks
them, and jaxtyping only remembers the sizes of a call. What a function got and gave in types and sizes that were good
once is good again. Not checked are functions made in a call, those that yield (beartype checks these at their first
value, among the sizes of whoever asks for it) and those that name a type which is only imported for type checkers.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import is_dataclass
from functools import cache, wraps
from typing import Any, get_type_hints

import jaxtyping
import numpy as np
from beartype import BeartypeConf, beartype

_TYPES = beartype(conf=BeartypeConf(is_pep484_tower=True, violation_type=TypeError))
"""an int is good for a float; what does not fit raises what a wrong argument raises elsewhere in Python"""
_jaxtyped: Any = jaxtyping.jaxtyped

_left_out = False
"""whether calls are not checked now"""


@contextmanager
def unchecked() -> Iterator[None]:
    """Calls are as those of users, whose arguments may be anything."""
    global _left_out
    _left_out = True
    try:
        yield
    finally:
        _left_out = False


def check_all_calls(package: str) -> None:
    """Check every call of a package that is not imported yet."""
    jaxtyping.install_import_hook(package, None)
    jaxtyping.jaxtyped = lambda **_: _checked


@cache
def _sizes() -> AbstractContextManager[None]:
    """Among which those of a call agree. It imports JAX, which a process that only hands out tests does not need."""
    return _jaxtyped("context")


def _checked(function: Any) -> Any:
    """The same function, or class of data, with its calls checked."""
    if inspect.isclass(function):
        if is_dataclass(function):
            function.__init__ = _checked(function.__init__)
        return function
    made_in_a_call, returns_an_unfinished_class = "<locals>" in function.__qualname__, function.__name__ == "__new__"
    if made_in_a_call or returns_an_unfinished_class or inspect.isgeneratorfunction(function):
        return function
    return _with_sizes(function) if function.__annotations__ else function


def _with_sizes(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that is to have the same sizes in the arguments and the result of a call.

    Its types are looked up at its first call, when all modules have been read.
    """
    checked = checked_result = None
    good: dict[Any, set[Any]] = {}
    """the kinds of results that were good, by those of the arguments"""

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal checked, checked_result
        if _left_out:
            return function(*args, **kwargs)
        given = _kinds(args)
        if kwargs:
            given = given, tuple(kwargs), _kinds(kwargs.values())
        results = good.get(given)
        if results is None:
            if checked is None:
                checked = _TYPES(function) if _has_known_types(function) else function
            with _sizes():
                result = checked(*args, **kwargs)
            good.setdefault(given, set()).add(_kinds((result,)))
            return result
        result = function(*args, **kwargs)
        told_by_type = _looks.get(type(result), _kinds) is None
        kind = (type(result),) if told_by_type else _kinds((result,))
        if kind not in results:
            if checked_result is None:
                again = wraps(function)(lambda *_, **__: found.pop())
                checked_result = _TYPES(again) if checked is not function else again
            found.append(result)
            with _sizes():
                checked_result(*args, **kwargs)
            results.add(kind)
        return result

    found: list[Any] = []
    return call


_MANY = 9
"""members of a tuple or list whose types are looked at"""

_array = np.ndarray
_looks: dict[type, Callable[[Any], Any] | None] = {}
"""how the kind of a value is told, by its type, which is all that there is to tell where this is none"""


def _kinds(values: Iterable[Any]) -> tuple[Any, ...]:
    """All of values that the checks depend on: their types, and sizes of arrays; a text is what it says."""
    kinds: list[Any] = []
    for value in values:
        kind = type(value)
        if kind is _array:
            kinds += value.shape, value.dtype
            continue
        try:
            look = _looks[kind]
        except KeyError:
            look = _looks[kind] = _look_of(kind)
        kinds.append(kind if look is None else look(value))
    return tuple(kinds)


def _look_of(kind: type) -> Callable[[Any], Any] | None:
    if issubclass(kind, str):
        return lambda value: value
    if hasattr(kind, "_fields"):
        return _look_of_named(kind)
    if issubclass(kind, tuple | list):
        return lambda value: (kind, len(value) > _MANY, _kinds(value[:_MANY]))
    if issubclass(kind, dict):
        return lambda value: (kind, _kinds(next(iter(value.items()), ())))
    if hasattr(kind, "shape") and hasattr(kind, "dtype") and not issubclass(kind, np.number):
        return lambda value: (kind, value.shape, value.dtype)
    return None


def _look_of_named(kind: type) -> Callable[[Any], Any]:
    """Of named tuples, which are given on from function to function: the last one is remembered."""
    last = told = None

    def look(value: Any) -> Any:
        nonlocal last, told
        if value is not last:
            last, told = value, (kind, _kinds(value[:_MANY]))
        return told

    return look


def _has_known_types(function: Callable[..., Any]) -> bool:
    """Whether every name in its annotations is known where the function is."""
    try:
        get_type_hints(function, include_extras=True)
    except NameError:
        return False
    return True
