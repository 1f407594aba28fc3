"""Types and shapes of arguments and results, checked at every call of the package.

Jaxtyping's own decorator takes 50 µs a call, as it binds the arguments anew for its messages. Here beartype checks
them, and jaxtyping only remembers the sizes of a call. Not checked are functions made in a call, those that yield
(beartype checks these at their first value, among the sizes of whoever asks for it) and those that name a type which
is only imported for type checkers.
"""

import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import wraps
from typing import Any, get_type_hints

import jaxtyping
from beartype import BeartypeConf, beartype

_TYPES = beartype(conf=BeartypeConf(is_pep484_tower=True, violation_type=TypeError))
"""an int is good for a float; what does not fit raises what a wrong argument raises elsewhere in Python"""
_SIZES = jaxtyping.jaxtyped("context")


def check_all_calls(package: str) -> None:
    """Check every call of a package that is not imported yet."""
    jaxtyping.install_import_hook(package, None)
    jaxtyping.jaxtyped = lambda **_: _checked


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
    checked: Callable[..., Any] | None = None

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal checked
        if checked is None:
            checked = _TYPES(function) if _has_known_types(function) else function
        with _SIZES:
            return checked(*args, **kwargs)

    return call


def _has_known_types(function: Callable[..., Any]) -> bool:
    """Whether every name in its annotations is known where the function is."""
    try:
        get_type_hints(function, include_extras=True)
    except NameError:
        return False
    return True
