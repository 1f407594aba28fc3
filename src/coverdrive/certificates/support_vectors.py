"""A support vector machine on the last hidden layer, for every base by itself (paper, appendix).

With h the H values of the last hidden layer (n̄ in the paper), the hyperplane of base j minimises ‖w‖²/2 + C·Σ ξ such
that w·h + b ≥ 1 for every covered calibration sample that drove base j (hard), and w·h + b ≤ −1 + ξ for training
samples that drove another base (soft): a convex program of H + 1 decision variables, of which Ω₂ gives the hard
constraints alone. Base j is possible iff w·h + b ≥ 1: what the calibration samples satisfy is what is certified. Of all
solutions the one with the least b counts, which makes it unique.

At most M·(H + 1) calibration samples support the solution. Often far fewer do, and
the wait-and-judge bound is for the number found. For every base, all samples on the margin count, or H + 1 if there are
more: a little noise on the constraints, as small as one likes, leaves no more than these, and the miss probability can
only be smaller than its limit (as in Calafiore 2010). Where no direction is worth its slack, w = 0: all samples are on
the margin, and the base is always possible.

Constraints are generated: the program is solved for few of them, and those that it violates most join, until none is.
"""

from functools import partial

import numpy as np
from jaxtyping import Float
from scipy import sparse

from coverdrive.certificates.bloating import scenario_certificate
from coverdrive.certificates.bounds import judged_bound, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import ROUNDING, Hyperplanes
from coverdrive.errors import CertificateError
from coverdrive.extras import require

PENALTY = 100.0
"""C: cost of the slack of a negative (authors' scripts)"""

NEGATIVES = 2000
"""Training samples of other bases that a hyperplane is drawn against, at most"""

_TOLERANCE = 1e-6
"""Constraints violated by less hold, those that hold by less support the solution, and the rule gives way by this."""

_JOINING = 300
_ROUNDS = 300


def support_vectors(calibration: Calibration, claim: Claim) -> tuple[Hyperplanes, Certificate]:
    """Hyperplanes that miss no covered calibration sample, and the bound on missing a new one; alike in every unit."""
    samples, training = calibration.samples, calibration.shaping
    hidden, others = _hidden(samples), _hidden(training)
    if hidden.shape[1] != others.shape[1]:
        raise CertificateError(
            f"calibration samples have {hidden.shape[1]} hidden values and training samples {others.shape[1]}; "
            "score both with the same network"
        )
    mean, scale = others.mean(0), np.where(others.std(0) > 0, others.std(0), 1)
    weights, offsets = np.zeros((calibration.bases, hidden.shape[1])), np.zeros(calibration.bases)
    supporting, most = [np.zeros(0, dtype=np.int64)], hidden.shape[1] + 1
    degenerate = 0
    random = np.random.default_rng(calibration.seed)
    for base in range(calibration.bases):
        windows = np.flatnonzero(calibration.in_tube & (samples.base == base))
        negatives = random.permutation(np.flatnonzero(training.base != base))[:NEGATIVES]
        if len(windows) == 0 or len(negatives) == 0:
            continue
        positive = (hidden[windows] - mean) / scale
        normal = _normal(positive, (others[negatives] - mean) / scale)
        margin = positive @ normal - (positive @ normal).min()
        on_margin = np.unique(calibration.unit[windows[margin <= _TOLERANCE]])
        if len(on_margin) > most:
            degenerate += 1
        else:
            supporting.append(on_margin)
        weights[base] = normal / scale
        slack = _TOLERANCE + ROUNDING * (np.abs(weights[base]) @ np.abs(hidden[windows]).max(0))
        offsets[base] = slack - (hidden[windows] @ weights[base]).min()
    support = min(len(np.unique(np.concatenate(supporting))) + degenerate * most, len(calibration))
    dimension = calibration.bases * (hidden.shape[1] + 1)
    certificate = scenario_certificate(
        calibration,
        claim,
        method="svm",
        bound=partial(judged_bound, support=support, samples=len(calibration)),
        paper_epsilon=rate_limit(claim.sure, dimension - 1, len(calibration)),
        support=support,
    )
    return Hyperplanes(weights, offsets, np.full(calibration.bases, calibration.tube)), certificate


def _hidden(samples: ScoredSamples) -> Float[np.ndarray, "N H"]:
    if samples.hidden is None:
        raise CertificateError(
            "support vectors need the values of the last hidden layer with the scores: box sets have none, those of "
            "base trajectories do (prediction.sets = 'bases'); fit these, or take another method"
        )
    return samples.hidden.astype(float)


def _normal(positive: Float[np.ndarray, "n H"], negative: Float[np.ndarray, "m H"]) -> Float[np.ndarray, " H"]:
    """The normal w of the hyperplane with all positives on its far side."""
    along = positive @ (positive.mean(0) - negative.mean(0))
    chosen = np.argsort(along, kind="stable")[:_JOINING]
    for _ in range(_ROUNDS):
        normal, offset = _solve(positive[chosen], negative)
        violation = 1 - (positive @ normal + offset)
        worst = np.argsort(-violation, kind="stable")[:_JOINING]
        joining = worst[violation[worst] > _TOLERANCE]
        if len(joining) == 0:
            return normal
        chosen = np.union1d(chosen, joining)
    raise CertificateError(f"no hyperplane was found in {_ROUNDS} rounds; take post-bloating, and please report this")


def _solve(
    positive: Float[np.ndarray, "n H"], negative: Float[np.ndarray, "m H"]
) -> tuple[Float[np.ndarray, " H"], float]:
    """Normal and offset for some of the positives; the objective is divided by C."""
    neurons, slacks = positive.shape[1], len(negative)
    curvature = np.r_[np.full(neurons, 1 / PENALTY), np.zeros(1 + slacks)]
    above = np.c_[positive, np.ones(len(positive))]
    below = np.c_[negative, np.ones(slacks)]
    constraints = sparse.block_array([[above, None], [below, -sparse.eye_array(slacks)]], format="csc")
    piqp = require("piqp")
    solver = piqp.SparseSolver()
    solver.setup(
        P=sparse.csc_matrix(sparse.diags_array(curvature)),
        c=np.r_[np.zeros(neurons + 1), np.ones(slacks)],
        G=sparse.csc_matrix(constraints),
        h_l=np.r_[np.ones(len(positive)), np.full(slacks, -np.inf)],
        h_u=np.r_[np.full(len(positive), np.inf), -np.ones(slacks)],
        x_l=np.r_[np.full(neurons + 1, -np.inf), np.zeros(slacks)],
    )
    status = solver.solve()
    if status != piqp.PIQP_SOLVED:
        raise CertificateError(f"no hyperplane was found ({status}); take post-bloating, and please report this")
    return np.asarray(solver.result.x[:neurons]), float(solver.result.x[neurons])
