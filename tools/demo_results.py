"""Make the results that `coverdrive demo` unpacks: `python tools/demo_results.py [--drives 40] [--out FILE]`.

A predictor of half the usual width is fitted to generated traffic and certified, and a study is driven with it among
IDM and MOBIL drivers. Stored are: the fit without the scores and tracks of its windows (5 MB), the table of all drives,
and the liveliest drive, whose numbers are rounded to what a page shows. To be made again whenever the version or a
default changes that a drive depends on.
"""

import argparse
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from coverdrive.cli.demo import STORED
from coverdrive.config import Experiment
from coverdrive.files import write_atomically
from coverdrive.prediction.fit import fit
from coverdrive.results import SCORES, SEEN, Results
from coverdrive.simulation.drives.storage import load_trace, save_trace
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.notable import liveliest

_COARSE, _FINE = 2**-6, 2**-9
"""units of predicted paths [m], and of all else [m, m/s, rad, …]; powers of two, for the sake of compression"""


def experiment_of(changes: dict[str, Any]) -> Experiment:
    small = {
        "prediction": {"boxes": {"hidden": (32, 32)}},
        "traffic": {"kind": "drivers"},
        "study": {"vehicles": (4,)},
    }
    return Experiment().updated(small).updated(changes)


def to_multiples(unit: float) -> Callable[[Any], Any]:
    """What rounds arrays of numbers to multiples of a unit, and leaves all else alone."""

    def rounded(value: Any) -> Any:
        return np.rint(value / unit) * unit if isinstance(value, np.ndarray) and value.dtype == float else value

    return rounded


def rounded(trace: Trace) -> Trace:
    fine, coarse = to_multiples(_FINE), to_multiples(_COARSE)
    states = {name: jax.tree.map(fine, getattr(trace, name)) for name in ("scene", "plans")}
    return replace(trace, paths=jax.tree.map(coarse, trace.paths), **states)


def drive(results: Results, drives: int) -> list[Path]:
    """Drive the study of a results folder, and keep its liveliest drive; the files to store."""
    study = results.study(results.experiment)
    study.run(drives, workers=os.cpu_count() or 1)
    trial = liveliest(study.trials)
    study.trace(trial)
    (file,) = (study.folder / "traces").iterdir()
    save_trace(rounded(load_trace(file)), file)
    return [study.folder / "study.json", study.folder / "trials.parquet", file]


def archive(folder: Path, files: list[Path]) -> bytes:
    """Files of a folder as a ZIP archive; equal contents give equal bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for file in files:
            name = zipfile.ZipInfo(file.relative_to(folder).as_posix())
            packed.writestr(name, file.read_bytes(), zipfile.ZIP_DEFLATED, 9)
    return content.getvalue()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--drives", type=int, default=40)
    options.add_argument("--out", type=Path, default=STORED)
    options.add_argument("--changes", type=json.loads, default={}, help="settings that differ, as JSON")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        results, experiment = Results(temporary), experiment_of(given.changes)
        results.save_fit(experiment, fit(experiment.recordings([]), experiment.prediction, experiment.seed))
        kept = [file for file in sorted(results.folder.iterdir()) if file.name not in (SCORES, SEEN)]
        content = archive(results.folder, [*kept, *drive(results, given.drives)])
    write_atomically(given.out, lambda file: file.write_bytes(content))
    print(f"{given.out}: {len(content) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
