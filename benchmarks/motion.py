"""What the lateral speed is worth: `python benchmarks/motion.py --recording PATH … [--out motion.json]`.

Every row has the same windows and splits, the calibration of `set_size.py` (conformal, one threshold, 99 % confidence)
and the default network but for its inputs.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coverdrive.prediction.cover.basis import make_basis
from coverdrive.prediction.fit import PredictionSettings, cut_and_split
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.samples import make_samples
from coverdrive.prediction.learning.training import TrainingSettings, train
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from set_size import CLAIMS, claims_of

INPUTS: tuple[Inputs, ...] = ("derived", "motion")


def sizes_of(
    recordings: Sequence[Recording], settings: PredictionSettings, seed: int, epochs: int | None
) -> tuple[int, dict[str, list[tuple[float, float, float]]]]:
    """Number of bases; and for either kind of inputs what `claims_of` gives."""
    segments, sides = cut_and_split(recordings, settings, seed)
    basis = make_basis(segments.of(sides.train), settings.basis, seed)
    samples = make_samples(recordings, segments, basis)
    mirrored = make_samples(recordings, segments.of(sides.train), basis, mirrored=True)
    training = samples.of(sides.train).and_also(mirrored.of(mirrored.distance.min(1) <= basis.radius))
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for inputs in INPUTS:
        chosen = TrainingSettings(inputs=inputs, **({"epochs": epochs} if epochs else {}))
        rows[inputs] = claims_of(train(training, chosen, seed)[0], samples, sides, basis, basis.radius)
    return len(basis), rows


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recording", type=Path, nargs="+", required=True)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--epochs", type=int, help="of every network, for a quick look")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(arguments)
    recordings = read(chosen.recording)
    found: dict[str, list[list[tuple[float, float, float]]]] = {}
    for seed in range(chosen.seeds):
        bases, rows = sizes_of(recordings, PredictionSettings(), seed, chosen.epochs)
        print(f"split {seed}: {bases} bases", flush=True)
        for inputs, row in rows.items():
            found.setdefault(inputs, []).append(row)
    values = {name: np.array(runs) for name, runs in found.items()}
    proved = np.isfinite(np.stack(list(values.values()))[..., 0]).all(0)
    print("mean set / median set / observed miss, over the splits in which every row can prove the claim:")
    for place, (unit, epsilon) in enumerate(CLAIMS):
        usable = proved[:, place]
        print(f"{epsilon:.0%} of {unit}s, {usable.sum()} splits")
        for name, runs in values.items():
            size, median, miss = runs[usable, place].mean(0) if usable.any() else (np.nan, np.nan, np.nan)
            smaller = (runs[usable, place, 0] < values["derived"][usable, place, 0]).sum()
            print(f"  {name:18s} {size:6.2f} /{median:6.2f} /{miss:6.2%}  smaller than the first in {smaller}")
    if chosen.out:
        chosen.out.write_text(json.dumps({name: runs.tolist() for name, runs in values.items()}, indent=2))


if __name__ == "__main__":
    main()
