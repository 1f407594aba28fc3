"""What a fit was made with and from: versions, seed, recordings and times."""

import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np
from jax import tree

from coverdrive._version import __version__
from coverdrive.certificates.certificate import fingerprint
from coverdrive.prediction.data.held_out import digest_of
from coverdrive.prediction.fit import Fit, PredictionSettings
from coverdrive.recordings.recording import Recording

_PACKAGES = ("jax", "equinox", "numba", "numpy", "scipy", "polars")


def provenance(fit: Fit) -> dict[str, Any]:
    """The same as JSON values."""
    recordings = [asdict(each) for each in fit.seen.sources]
    return versions() | {"seed": fit.seed, "recordings": recordings, "seconds": fit.seconds}


def made_from(recordings: Sequence[Recording], settings: PredictionSettings, seed: int) -> str:
    """A short hash of all that a fit depends on: what is in the recordings, their roads, settings and seed."""
    roads = [fingerprint(*map(np.asarray, tree.leaves(each.road))) for each in recordings]
    asked = json.dumps([[digest_of(each) for each in recordings], roads, settings.model_dump(mode="json"), seed])
    return fingerprint(np.frombuffer(asked.encode(), np.uint8))


def versions() -> dict[str, Any]:
    """Versions of this package, of Python, and of what numbers depend on."""
    packages = {name: version(name) for name in _PACKAGES}
    return {"coverdrive": __version__, "python": platform.python_version(), "packages": packages}
