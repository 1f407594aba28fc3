"""Types and shapes of arguments and results, checked at every call of the package.

Jaxtyping's own decorator takes 50 µs a call, as it binds the arguments anew for its messages. Here beartype checks
them, and jaxtyping only remembers the sizes of a call; functions made in a call are not checked.
"""

import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import wraps
from typing import Any

import jaxtyping
from beartype import BeartypeConf, beartype

_TYPES = beartype(conf=BeartypeConf(is_pep484_tower=True))
"""an int is good for a float"""
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
    if made_in_a_call or returns_an_unfinished_class or not function.__annotations__:
        return function
    return _with_sizes(_TYPES(function))


def _with_sizes(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that is to have the same sizes in the arguments and the result of a call."""

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        with _SIZES:
            return function(*args, **kwargs)

    return call
