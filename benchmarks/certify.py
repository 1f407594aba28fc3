"""Time of every method of calibration against plain NumPy: `python benchmarks/certify.py [--out certify.json]`.

Samples are made up: every base is a cloud in the last hidden layer, and its score falls with the distance from the
cloud's centre. The baselines are written as one would at first: loops over bases, rules or discarded samples. That of
the hyperplanes hands all constraints to the solver at once. Each has to find the same rule. The package also checks
that no vehicle trained the network, and fingerprints the samples: that takes longer than the shortest baselines.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverdrive.certificates import support_vectors
from coverdrive.certificates.bounds import discards_allowed, marginal_misses_allowed, misses_allowed
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.methods import Method, certify
from coverdrive.certificates.nested_sets import quantile_sets
from coverdrive.certificates.rule import Hyperplanes, Rule

EPSILON, CONFIDENCE, TUBE = 0.1, 0.99, 0.75
BASES, NEURONS = 17, 50


class Task(NamedTuple):
    """What every method and its baseline are given."""

    samples: ScoredSamples
    training: ScoredSamples

    def solved(self, method: Method) -> Rule:
        """The rule of the package."""
        calibration = Calibration.of(self.samples, TUBE, self.training.vehicle, training=self.training)
        return certify(method, calibration, Claim(None if method.computes_epsilon else EPSILON, CONFIDENCE))[0]


def made_up(count: int, seed: int, first: int) -> ScoredSamples:
    random = np.random.default_rng(seed)
    centres = np.random.default_rng(0).normal(0, 1, (BASES, NEURONS))
    base = random.integers(0, BASES, count)
    hidden = centres[base] + random.normal(0, 1, (count, NEURONS))
    scores = 1 / (1 + np.exp((hidden**2).sum(1)[:, None] / 20 - hidden @ centres.T / 5))
    return ScoredSamples(scores, base, np.zeros(count), first + np.arange(count), hidden)


def post_bloating(task: Task) -> np.ndarray:
    samples = task.samples
    return np.array([samples.scores[samples.base == j, j].min() for j in range(BASES)])


def discarding(task: Task) -> np.ndarray:
    samples = task.samples
    budget = discards_allowed(EPSILON, CONFIDENCE, BASES, len(samples))
    mine = [np.sort(samples.scores[samples.base == j, j]) for j in range(BASES)]
    everyone = [np.sort(samples.scores[:, j]) for j in range(BASES)]
    for _ in range(budget):
        gains = [
            np.searchsorted(everyone[j], mine[j][1]) - np.searchsorted(everyone[j], mine[j][0])
            if len(mine[j]) > 1
            else 0
            for j in range(BASES)
        ]
        best = int(np.argmax(gains))
        mine[best] = mine[best][1:]
    return np.array([scores[0] for scores in mine])


def nested_sets(task: Task) -> np.ndarray:
    samples = task.samples
    allowed = misses_allowed(EPSILON, CONFIDENCE, len(samples))
    driven = samples.scores[np.arange(len(samples)), samples.base]
    rules = quantile_sets(task.training)
    return [values for values in rules if (driven < values[samples.base]).sum() <= allowed][-1]


def pooled(allowed: Callable[[int], int]) -> Callable[[Task], np.ndarray]:
    def thresholds(task: Task) -> np.ndarray:
        samples = task.samples
        driven = np.sort(samples.scores[np.arange(len(samples)), samples.base])
        return np.full(BASES, driven[allowed(len(driven))])

    return thresholds


def per_base(allowed: Callable[[int], int]) -> Callable[[Task], np.ndarray]:
    def thresholds(task: Task) -> np.ndarray:
        samples = task.samples
        driven = [np.sort(samples.scores[samples.base == j, j]) for j in range(BASES)]
        return np.array([scores[allowed(len(scores))] if allowed(len(scores)) >= 0 else 0 for scores in driven])

    return thresholds


def hyperplanes(task: Task) -> np.ndarray:
    """All constraints at once: the same draw of negatives, and a batch that holds all positives."""
    joining = support_vectors._JOINING
    support_vectors._JOINING = len(task.samples)
    try:
        return task.solved(Method.SVM).weights
    finally:
        support_vectors._JOINING = joining


def marginal(count: int) -> int:
    return marginal_misses_allowed(EPSILON, count)


def pac(count: int) -> int:
    return misses_allowed(EPSILON, CONFIDENCE, count)


def pac_in_groups(count: int) -> int:
    return misses_allowed(EPSILON, 1 - (1 - CONFIDENCE) / BASES, count)


BASELINES = {
    Method.POST_BLOATING: post_bloating,
    Method.SVM: hyperplanes,
    Method.DISCARDING: discarding,
    Method.NESTED_SETS: nested_sets,
    Method.POOLED: pooled(marginal),
    Method.PER_BASE: per_base(marginal),
    Method.PAC_POOLED: pooled(pac),
    Method.PAC_PER_BASE: per_base(pac_in_groups),
}


def compared(method: Method, training: ScoredSamples, samples: ScoredSamples) -> dict[str, float | bool]:
    task = Task(samples, training)
    start = time.perf_counter()
    rule = task.solved(method)
    seconds = time.perf_counter() - start
    start = time.perf_counter()
    expected = BASELINES[method](task)
    baseline = time.perf_counter() - start
    found = rule.weights if isinstance(rule, Hyperplanes) else rule.values
    return {
        "seconds": seconds,
        "baseline seconds": baseline,
        "times faster": baseline / seconds,
        "same rule": bool(np.allclose(found, expected, rtol=1e-3, atol=1e-4)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=40_000)
    parser.add_argument("--out", type=Path, default=Path("certify.json"))
    arguments = parser.parse_args()
    training, samples = made_up(arguments.samples, 1, 0), made_up(arguments.samples, 2, arguments.samples)
    Task(samples, training).solved(Method.NESTED_SETS)
    methods = {method.value: compared(method, training, samples) for method in Method}
    result = {
        "samples": len(samples),
        "bases": BASES,
        "hidden neurons": NEURONS,
        "epsilon": EPSILON,
        "seconds in all": sum(each["seconds"] for each in methods.values()),
        "methods": methods,
    }
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
