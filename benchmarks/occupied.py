"""How large certified sets are: `python benchmarks/occupied.py --recording PATH … [--folds 4] [--out occupied.json]`.

With scene groups in every role (`coverdrive.prediction.fits.folds`), the boxes of the default and constant velocity in
one conformal box are certified on the same vehicles for the same claim, 99 % confidence: at most 10 % of vehicles
missed at all, and at most 5 % of windows, as if these were independent. The ratio to constant velocity is also given
for a box that has to hold no bodies, but centres alone. Without recordings, on generated traffic.

`--seeds 6 --save set-sizes`: how much the sets of `coverdrive fit` depend on the seed of its training, where either
half of the recorded scenes certifies, and on generated traffic.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from coverdrive.certificates.certificate import Unit
from coverdrive.errors import CertificateError
from coverdrive.prediction.boxes.training import BoxSettings
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.certifying.occupied import compared
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.data.split import rotations
from coverdrive.prediction.fit import Fit, PredictionSettings, fit
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from results import save

CLAIMS: tuple[tuple[Unit, float], ...] = (("vehicle", 0.1), ("window", 0.05))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recording", type=Path, nargs="+")
    parser.add_argument("--scenes", type=int, default=48, help="of generated traffic")
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--unit", choices=[unit for unit, _ in CLAIMS], help="one of the claims alone")
    parser.add_argument("--steps", type=int, default=1500, help="of training")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--seeds", type=int, help="of training, with the default claim alone")
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    chosen = parser.parse_args(arguments)
    if chosen.seeds:
        save(chosen.save, by_seed(read(chosen.recording), chosen.seeds), 0)
        return
    recordings = read(chosen.recording) if chosen.recording else generate(GeneratedSettings(scenes=chosen.scenes))
    segments = cut_segments(recordings)
    rows: list[dict[str, object]] = []
    claims = [(unit, epsilon) for unit, epsilon in CLAIMS if chosen.unit in (None, unit)]
    for sides in rotations(segments.vehicle, segments.group, chosen.folds, 0):
        for unit, epsilon in claims:
            claim = CertificateSettings(unit=unit, epsilon=epsilon)
            settings = PredictionSettings(boxes=BoxSettings(most_steps=chosen.steps), certificate=claim)
            try:
                row = measured(fit(recordings, settings, sides=sides))
            except CertificateError as error:
                print(f"{epsilon:.0%} of {unit}s: {error}", flush=True)
                continue
            rows.append(row)
            print(
                ", ".join(f"{name} {value:.3g}" if name != "unit" else str(value) for name, value in row.items()),
                flush=True,
            )
    for unit, epsilon in claims:
        mine = [row for row in rows if row["unit"] == unit]
        for name in ("area", "ratio", "ratio to centres", "missed", "baseline missed"):
            values = np.array([row[name] for row in mine], dtype=float)
            if len(values):
                print(f"{epsilon:.0%} of {unit}s, {len(mine)} folds, {name}: {values.mean():.3g} "
                      f"({values.min():.3g} to {values.max():.3g})")  # fmt: skip
    if chosen.out:
        chosen.out.write_text(json.dumps(rows, indent=2))


def by_seed(recordings: Sequence[Recording], seeds: int) -> dict[str, dict[str, list[float]]]:
    """Mean, least and largest areas of certified sets and of those that drive, over seeds of training."""
    segments, made_up, found = cut_segments(recordings), generate(GeneratedSettings()), {}
    halves = rotations(segments.vehicle, segments.group, 3, 0)
    if len(halves) != 2:
        raise SystemExit("the recordings do not fall into two groups that share no vehicle")
    ways = [(str(len(np.unique(segments.vehicle[each.calibration]))), recordings, each) for each in halves]
    for name, scenes, sides in [*ways, ("generated", made_up, None)]:
        fits = [fit(scenes, seed=seed, sides=sides) for seed in range(seeds)]
        of = {
            "area": [each.evaluation.mean_area or np.nan for each in fits],
            "driven area": [each.driven.mean_area or np.nan for each in fits],
        }
        found[name] = {key: [float(np.mean(areas)), min(areas), max(areas)] for key, areas in of.items()}
        print(name, found[name], flush=True)
    return found


def measured(fitted: Fit) -> dict[str, object]:
    """How large the sets are, also against a box that holds centres alone, and how much is missed."""
    occupied, trivial = fitted.occupied, fitted.occupied.baseline_evaluation
    assert trivial is not None
    unit = fitted.settings.certificate.unit
    straight = replace(fitted.segments, heading=np.zeros_like(fitted.segments.heading))
    claimed = straight, fitted.split, fitted.settings.certificate, fitted.predictor.calibrated
    missed, baseline_missed = (each.missed(unit).value for each in (fitted.evaluation, trivial))
    return {
        "unit": unit,
        "area": occupied.mean,
        "ratio": occupied.ratio,
        "ratio to centres": compared(np.array(occupied.areas), (), *claimed, fitted.seed).ratio,
        "missed": missed,
        "baseline missed": baseline_missed,
    }


if __name__ == "__main__":
    main()
