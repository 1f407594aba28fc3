"""What results say about themselves: where they come from, and what was certified, as JSON files."""

import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import coverdrive
from coverdrive.certificates.certificate import fingerprint
from coverdrive.config import Experiment
from coverdrive.files import write_atomically
from coverdrive.prediction.fit import Fit
from coverdrive.recordings.recording import Recording

_PACKAGES = ("jax", "equinox", "numba", "numpy", "scipy", "casadi", "polars")


def write_json(path: Path, content: Any) -> None:
    """Write JSON atomically."""
    text = json.dumps(content, indent=2)
    write_atomically(path, lambda file: file.write_text(text + "\n", encoding="utf-8"))


def provenance(experiment: Experiment, recordings: Sequence[Recording]) -> dict[str, Any]:
    """What a result was made from."""
    return {
        "coverdrive": coverdrive.__version__,
        "python": platform.python_version(),
        "packages": {name: version(name) for name in _PACKAGES},
        "seed": experiment.seed,
        "recordings": [
            {"name": recording.name, "rows": len(recording.table), "fingerprint": _fingerprint(recording)}
            for recording in recordings
        ],
    }


def _fingerprint(recording: Recording) -> str:
    return fingerprint(*(recording.table[name].to_numpy() for name in recording.table.columns))


def certificate_record(result: Fit) -> dict[str, Any]:
    """Certificates, and how they did on the test split, as JSON values."""
    return {
        "certificates": [
            asdict(certificate) | {"sentence": certificate.sentence} for certificate in result.certificates
        ],
        "test": asdict(result.evaluation),
        "uncovered": asdict(result.uncovered),
        "samples": {
            "segments": len(result.segments),
            "train": len(result.split.train),
            "calibration": len(result.split.calibration),
            "test": len(result.split.test),
            "dropped": result.split.dropped,
        },
    }
