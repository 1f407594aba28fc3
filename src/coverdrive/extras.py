"""Packages that only some commands need, and the extra of the installation that each belongs to."""

import importlib
from typing import Any, NamedTuple

from coverdrive.errors import MissingExtraError


class Extra(NamedTuple):
    """A package that is not always installed."""

    package: str
    """its name for readers"""
    extra: str
    """name of the extra"""
    purpose: str
    """what needs it"""

    @property
    def command(self) -> str:
        """What installs it, in the folder of the sources."""
        return f"pip install '.[{self.extra}]'"


EXTRAS = {
    "casadi": Extra("CasADi", "reference", "the paper's program"),
    "piqp": Extra("PIQP", "svm", "the method svm"),
    "distributed": Extra("Dask", "cluster", "--cluster"),
    "gymnasium": Extra("Gymnasium", "gymnasium", "coverdrive.bridges.gymnasium"),
    "highway_env": Extra("highway-env", "highway-env", "coverdrive.bridges.highway_env"),
    "libsumo": Extra("libsumo", "sumo", "coverdrive.bridges.sumo"),
}
"""by the module to import"""


def require(module: str) -> Any:
    """A module of an extra.

    Raises:
        MissingExtraError: it is not installed, or lacks something itself.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        needed = EXTRAS[module]
        told = f"install it with `{needed.command}` in the folder of the sources"
        if error.name != module:
            told = f"it is installed, but does not load: {error}"
        raise MissingExtraError(f"{needed.purpose} needs {needed.package}; {told}") from error
