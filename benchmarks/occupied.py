"""How large certified sets are: `python benchmarks/occupied.py --recording PATH … [--folds 4] [--out occupied.json]`.

With scene groups in every role (`coverdrive.prediction.folds`), the boxes of the default and constant velocity in one
conformal box are certified on the same vehicles for the same claim, 99 % confidence: at most 10 % of vehicles missed at
all, and at most 5 % of windows, as if these were independent. The ratio to constant velocity is also given for a box
that has to hold no bodies, but centres alone. Without recordings, on generated traffic.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.rule import scale_of
from coverdrive.errors import CertificateError
from coverdrive.prediction.boxes.boxes import TUBE
from coverdrive.prediction.boxes.training import BoxSettings
from coverdrive.prediction.calibrate import CertificateSettings, calibrated
from coverdrive.prediction.fit import Fit, PredictionSettings, fit
from coverdrive.prediction.occupied import compared
from coverdrive.prediction.segments import cut_segments
from coverdrive.prediction.split import rotations
from coverdrive.recordings.read import read
from coverdrive.simulation.generated import GeneratedSettings, generate

CLAIMS: tuple[tuple[Unit, float], ...] = (("vehicle", 0.1), ("window", 0.05))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recording", type=Path, nargs="+")
    parser.add_argument("--scenes", type=int, default=48, help="of generated traffic")
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--steps", type=int, default=1500, help="of training")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(arguments)
    recordings = read(chosen.recording) if chosen.recording else generate(GeneratedSettings(scenes=chosen.scenes))
    segments = cut_segments(recordings)
    rows: list[dict[str, object]] = []
    for sides in rotations(segments.vehicle, segments.group, chosen.folds, 0):
        unit, epsilon = CLAIMS[0]
        boxes, claim = BoxSettings(most_steps=chosen.steps), CertificateSettings(unit=unit, epsilon=epsilon)
        try:
            result = fit(recordings, PredictionSettings(boxes=boxes, certificate=claim), sides=sides)
        except CertificateError as error:
            print(f"{epsilon:.0%} of {unit}s: {error}", flush=True)
            continue
        for unit, epsilon in CLAIMS:
            row = measured(result, CertificateSettings(unit=unit, epsilon=epsilon))
            rows.append(row)
            print(
                {name: f"{value:.3g}" if isinstance(value, float) else value for name, value in row.items()}, flush=True
            )
    for unit, epsilon in CLAIMS:
        mine = [row for row in rows if row["unit"] == unit]
        for name in ("area", "ratio", "ratio to centres", "missed", "baseline missed"):
            values = np.array([row[name] for row in mine], dtype=float)
            if len(values):
                print(f"{epsilon:.0%} of {unit}s, {len(mine)} folds, {name}: {values.mean():.3g} "
                      f"({values.min():.3g} to {values.max():.3g})")  # fmt: skip
    if chosen.out:
        chosen.out.write_text(json.dumps(rows, indent=2))


def measured(fitted: Fit, claim: CertificateSettings) -> dict[str, object]:
    """What the network of a fit gives for a claim."""
    scored, segments = fitted.scored, fitted.segments
    (rule, certificate), _ = calibrated(
        lambda rule, certificate, _: (rule, certificate), TUBE, scored.train, scored.calibration, claim, fitted.seed
    )
    areas = np.array(fitted.occupied.areas) * (scale_of(rule) / scale_of(fitted.predictor.rule)) ** 2
    straight = replace(segments, heading=np.zeros_like(segments.heading))
    whole, centres = (compared(areas, each, fitted.split, claim, certificate, 0) for each in (segments, straight))
    assert whole.baseline_evaluation is not None
    evaluations = evaluate(rule, scored.test), whole.baseline_evaluation
    missed, baseline_missed = (each.missed(claim.unit).value for each in evaluations)
    return {
        "unit": claim.unit,
        "area": whole.mean,
        "ratio": whole.ratio,
        "ratio to centres": centres.ratio,
        "missed": missed,
        "baseline missed": baseline_missed,
    }


if __name__ == "__main__":
    main()
