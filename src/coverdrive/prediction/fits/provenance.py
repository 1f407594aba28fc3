"""What a fit was made with and from: versions, seed, recordings and times."""

import platform
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

from coverdrive._version import __version__
from coverdrive.prediction.fit import Fit

_PACKAGES = ("jax", "equinox", "numba", "numpy", "scipy", "polars")


def provenance(fit: Fit) -> dict[str, Any]:
    """The same as JSON values."""
    recordings = [asdict(each) for each in fit.seen.sources]
    return versions() | {"seed": fit.seed, "recordings": recordings, "seconds": fit.seconds}


def versions() -> dict[str, Any]:
    """Versions of this package, of Python, and of what numbers depend on."""
    packages = {name: version(name) for name in _PACKAGES}
    return {"coverdrive": __version__, "python": platform.python_version(), "packages": packages}
