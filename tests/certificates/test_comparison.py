"""All methods side by side: each holds on unseen samples, and each refusal says why."""

import numpy as np
from certificates_fakes import Task

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.comparison import compare
from coverdrive.certificates.methods import Method
from coverdrive.progress import heard_by, stage

BASES = 4


def drawn(count: int, seed: int, first_vehicle: int) -> ScoredSamples:
    """Samples whose driven base scores higher than the others; one window for each vehicle."""
    random = np.random.default_rng(seed)
    base = random.integers(0, BASES, count)
    scores = random.beta(1, 4, (count, BASES))
    scores[np.arange(count), base] = random.beta(4, 1, count)
    return ScoredSamples(scores, base, np.zeros(count), first_vehicle + np.arange(count), scores)


def task_of(calibration: int) -> Task:
    training = drawn(2000, seed=0, first_vehicle=0)
    samples = drawn(calibration, seed=1, first_vehicle=10_000)
    return Task(samples, 0.5, training.vehicle, confidence=0.9, training=training)


def test_every_method_at_every_target() -> None:
    reported: list[float] = []
    task, test = task_of(2000), drawn(4000, seed=2, first_vehicle=50_000)
    with heard_by(lambda _, share: reported.append(share)), stage("methods"):
        compared = compare(task.calibration, task.claim, test, [0.05, 0.1])
    assert len(compared) == 2 * len(Method) - 2  # post-bloating and svm take no target
    assert reported[-1] == 1 and reported == sorted(reported)
    for each in compared:
        assert each.refusal == "" and each.certificate is not None and each.missed is not None
        average = each.certificate.confidence is None  # such a bound may be exceeded after one calibration
        assert each.missed.low <= each.certificate.epsilon * (1.2 if average else 1), each.method
    sizes = {(each.method, each.target): each.evaluation.mean_set_size for each in compared if each.evaluation}
    for method in Method:
        if not method.computes_epsilon:
            assert sizes[method, 0.1] <= sizes[method, 0.05]


def test_too_few_samples_are_refused_one_by_one() -> None:
    task = task_of(30)
    compared = compare(task.calibration, task.claim, drawn(100, seed=2, first_vehicle=50_000), [0.01])
    refused = {each.method: each for each in compared if each.refusal}
    assert Method.PAC_POOLED in refused and Method.POST_BLOATING not in refused
    for each in refused.values():
        assert each.certificate is None and each.missed is None
