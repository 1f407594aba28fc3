"""Set size at the same guarantee: `python benchmarks/set_size.py [--recording PATH …] [--out set_size.json]`.

Every predictor has the same bases, splits and calibration (conformal, one threshold for all bases, 99 % confidence) and
the same notion of a miss: no possible base within whose tube the vehicle stays. One row counts as the paper does: the
base nearest to what the vehicle did has to be possible. All numbers are of unseen scenes, averaged over the splits; the
baseline of the ratios is the paper's network. Without recordings, traffic is generated.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import equinox as eqx
import numpy as np

from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method, certify
from coverdrive.errors import CertificateError
from coverdrive.prediction.certifying.scored import score
from coverdrive.prediction.cover.basis import Basis, make_basis
from coverdrive.prediction.data.split import Split
from coverdrive.prediction.fit import PredictionSettings, cut_and_split
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.samples import Samples, make_samples
from coverdrive.prediction.learning.training import TrainingSettings, train
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

PAPER = "the paper's network"
CLAIMS: tuple[tuple[Unit, float], ...] = (("window", 0.01), ("window", 0.05), ("vehicle", 0.1))
PLAIN = TrainingSettings(inputs="affordance", mirrored=False, members=1, prior=0.0)
VARIANTS = {
    PAPER: TrainingSettings.paper(),
    "cross-entropy": PLAIN,
    "… with prior": PLAIN.model_copy(update={"prior": 0.3}),
    "… and derived inputs": PLAIN.model_copy(update={"prior": 0.3, "inputs": "derived"}),
    "… and mirror images": TrainingSettings(members=1),
    "… and four members (default)": TrainingSettings(),
}


def sizes_of(
    recordings: Sequence[Recording], settings: PredictionSettings, seed: int, variants: Mapping[str, TrainingSettings]
) -> dict[str, list[tuple[float, float, float]]]:
    """Of every predictor and claim: mean and median set size, and the observed miss rate; NaN where it is refused."""
    segments, sides = cut_and_split(recordings, settings, seed)
    basis = make_basis(segments.of(sides.train), settings.basis, seed)
    samples = make_samples(recordings, segments, basis)
    training = samples.of(sides.train)
    mirrored = make_samples(recordings, segments.of(sides.train), basis, mirrored=True)
    both = training.and_also(mirrored.of(mirrored.distance.min(1) <= basis.radius))
    shares = (np.bincount(training.base, minlength=len(basis)) / len(training)).astype(np.float32)

    nearest = make_samples(recordings, segments, basis, "nearest")
    networks = {name: train(both if each.mirrored else training, each, seed)[0] for name, each in variants.items()}
    networks[PAPER] = train(nearest.of(sides.train), variants[PAPER], seed)[0]
    networks["class frequencies"] = eqx.tree_at(lambda network: network.prior, networks[PAPER], shares)
    rows = {name: claims_of(network, samples, sides, basis, basis.radius) for name, network in networks.items()}
    rows[f"{PAPER}, nearest base"] = claims_of(networks[PAPER], nearest, sides, basis, None)
    return rows


def claims_of(
    network: Network, samples: Samples, sides: Split, basis: Basis, tube: float | None
) -> list[tuple[float, float, float]]:
    train_side, calibration, test = (
        score(network, samples.of(part), tube) for part in (sides.train, sides.calibration, sides.test)
    )
    found: list[tuple[float, float, float]] = []
    for unit, epsilon in CLAIMS:
        known = np.unique(train_side.vehicle)
        units = Calibration.of(calibration, basis.radius, known, unit, training=train_side)
        try:
            result = evaluate(certify(Method.PAC_POOLED, units, Claim(epsilon))[0], test)
        except CertificateError:
            found.append((np.nan, np.nan, np.nan))
            continue
        missed = result.windows if unit == "window" else result.vehicles
        found.append((result.mean_set_size, result.median_set_size, missed.value))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recording", type=Path, nargs="*", default=[])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--epochs", type=int, help="of every network, for a quick look")
    parser.add_argument("--scenes", type=int, default=48, help="that are generated where there are no recordings")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(arguments)
    recordings = read(chosen.recording) if chosen.recording else generate(GeneratedSettings(scenes=chosen.scenes))
    few = {"epochs": chosen.epochs} if chosen.epochs else {}
    variants = {name: each.model_copy(update=few) for name, each in VARIANTS.items()}
    runs = [sizes_of(recordings, PredictionSettings(), seed, variants) for seed in range(chosen.seeds)]
    rows = {name: np.array([run[name] for run in runs]) for name in runs[0]}
    means = {name: np.ma.masked_invalid(values).mean(0).filled(np.nan) for name, values in rows.items()}
    ratio = {name: (mean[:, 0] / means[PAPER][:, 0]).tolist() for name, mean in means.items()}
    proved = np.isfinite(rows[PAPER][..., 0]).sum(0)
    print("mean set / median set / observed miss, and mean set against that of the paper's network, at")
    heads = [f"{epsilon:.0%} of {unit}s" for unit, epsilon in CLAIMS]
    print(" " * 34 + "".join(f"{head:>34s}" for head in heads))
    print("splits that can prove it".ljust(34) + "".join(f"{count:>34d}" for count in proved))
    for name, mean in means.items():
        cells = (
            f"{size:8.2f} /{median:6.2f} /{miss:6.2%} {against:6.2f}×"
            for (size, median, miss), against in zip(mean, ratio[name], strict=True)
        )
        print(f"{name:34s}" + "".join(f"{cell:>34s}" for cell in cells))
    if chosen.out:
        chosen.out.write_text(
            json.dumps({name: {"runs": rows[name].tolist(), "ratio": ratio[name]} for name in rows}, indent=2)
        )


if __name__ == "__main__":
    main()
