"""Bounds on shares hold whatever windows of a vehicle, or vehicles of a group, have in common; counts do not."""

from dataclasses import replace

import numpy as np
import pytest
from certificates_fakes import learn_then_test, losses
from scipy.special import ndtr, xlogy
from scipy.stats import binom

from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.evaluation import Rate, evaluate
from coverdrive.certificates.mean_loss import fractions, loss_limit, proves, units_needed
from coverdrive.certificates.methods import Method, certify
from coverdrive.certificates.nested_sets import quantile_sets
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError

NOBODY = np.array([], dtype=np.int64)
CLAIM = Claim(0.2, 0.9)


def alike(groups: int, vehicles: int, windows: int, seed: int, by_group: float = 0.0, by_vehicle: float = 0.0):
    """Uniform scores of one base, which have shares of their variance in common in a group and in a vehicle.

    The threshold c misses any window with the probability c.
    """
    random = np.random.default_rng(seed)
    normal = random.normal(size=(groups, 1, 1)) * np.sqrt(by_group)
    normal = normal + random.normal(size=(groups, vehicles, 1)) * np.sqrt(by_vehicle)
    normal = normal + random.normal(size=(groups, vehicles, windows)) * np.sqrt(1 - by_group - by_vehicle)
    count = normal.size
    vehicle = np.arange(count) // windows
    zero = np.zeros(count, dtype=np.int64)
    scores = ndtr(normal).reshape(-1, 1)
    return ScoredSamples(scores, zero, 0.0 * zero, vehicle, None, vehicle // vehicles)


def threshold(samples: ScoredSamples, unit: Unit, claim: Claim = CLAIM) -> float:
    method = Method.PAC_POOLED if claim.confidence else Method.POOLED
    rule, _ = certify(method, Calibration.of(samples, 1.0, NOBODY, unit), claim)
    assert isinstance(rule, Thresholds)
    return float(rule.values[0])


def test_bets_by_hand() -> None:
    """Fractions go in equal ratios from 1 − p/ε, with 3·KL(p‖ε) = log 10, to 0.99, and their capitals are averaged."""
    losses, epsilon = np.array([0.5, 0.0, 0.0]), 0.8
    staked = fractions(3, epsilon, np.log(10))
    share = (1 - staked[0]) * epsilon
    divergence = share * np.log(share / epsilon) + (1 - share) * np.log((1 - share) / (1 - epsilon))
    assert 3 * divergence == pytest.approx(np.log(10))
    assert staked[-1] == pytest.approx(0.99) and len(set(np.round(staked[1:] / staked[:-1], 9))) == 1
    capitals = [(1 + c * 0.3 / 0.2) * (1 + c * 0.8 / 0.2) ** 2 for c in staked]
    assert proves(losses, epsilon, 0.9) is bool(np.mean(capitals) >= 10)
    limit = loss_limit(losses, 0.9)
    assert 0.4 < limit < 1 and proves(losses, limit, 0.9) and not proves(losses, limit - 1e-5, 0.9)


@pytest.mark.parametrize("count", [3, 40, 2000])
def test_what_proves_a_bound_proves_every_larger_one(count: int) -> None:
    for seed in range(5):
        proved = [proves(shares(count, seed), epsilon, 0.99) for epsilon in np.linspace(0.01, 0.99, 99)]
        assert proved == sorted(proved) and not proved[0]


def shares(units: int, seed: int) -> np.ndarray:
    """Losses of vehicles, 0.2 on average: most lose nearly nothing, some nearly all."""
    return np.random.default_rng(seed).beta(0.3, 1.2, units)


def test_the_order_of_the_units_does_not_matter() -> None:
    losses = shares(113, 3)
    shuffled = [np.random.default_rng(seed).permutation(losses) for seed in range(20)]
    assert len({loss_limit(each, 0.99) for each in shuffled}) == 1
    one = [_ever(each, loss_limit(losses, 0.99), 0.99) for each in shuffled]
    assert 0 < sum(one) < 20  # the negative control: bets in the order of storage prove it or do not


def _ever(losses: np.ndarray, epsilon: float, confidence: float) -> bool:
    """Whether bets in one order ever reach their goal, which may be asked of one order only."""
    goal = -np.log1p(-confidence)
    count = np.arange(1, len(losses) + 1)
    mean = (0.5 + np.cumsum(losses)) / (count + 1)
    spread = np.append(0.25, (0.25 + np.cumsum((losses - mean) ** 2)) / (count + 1))[:-1]
    stakes = np.minimum(np.sqrt(2 * goal / (len(losses) * spread)), 0.99 / (1 - epsilon))
    return bool(np.cumsum(np.log1p(stakes * (epsilon - losses))).max() >= goal)


def test_a_false_bound_is_rarely_proved_unless_the_order_is_chosen() -> None:
    """A mean of 0.2 is proved to be at most 0.2 by at most one calibration in ten."""
    drawn = [shares(60, seed) for seed in range(1000)]
    assert np.mean([proves(each, 0.2, 0.9) for each in drawn]) < 0.1
    random = np.random.default_rng(0)
    chosen = [any(_ever(random.permutation(each), 0.2, 0.9) for _ in range(20)) for each in drawn[:200]]
    assert np.mean(chosen) > 0.2  # the negative control: the best of 20 orders


def test_other_bounds_are_larger() -> None:
    """Of vehicles of which a tenth loses a share: stakes that are learned on the way, and Hoeffding's and Bentkus'."""
    goal = np.log(100)

    def learned(losses: np.ndarray, epsilon: float) -> bool:
        capitals = []
        for seed in range(30):
            order = np.random.default_rng(seed).permutation(losses)
            count = np.arange(1, len(losses) + 1)
            mean = (0.5 + np.cumsum(order)) / (count + 1)
            spread = np.append(0.25, (0.25 + np.cumsum((order - mean) ** 2)) / (count + 1))[:-1]
            stakes = np.minimum(np.sqrt(2 * goal / (len(losses) * spread)), 0.99 / (1 - epsilon))
            capitals.append(np.log1p(stakes * (epsilon - order)).sum())
        return bool(np.logaddexp.reduce(capitals) - np.log(30) >= goal)

    def tails(losses: np.ndarray, epsilon: float) -> bool:
        count, mean = len(losses), min(losses.mean(), epsilon)
        hoeffding = -count * (xlogy(mean, mean / epsilon) + xlogy(1 - mean, (1 - mean) / (1 - epsilon)))
        bentkus = 1 + binom.logcdf(np.ceil(losses.sum()), count, epsilon)
        return bool(min(hoeffding, bentkus) <= -goal)

    found = []
    for units in (91, 203):
        for seed in range(5):
            random = np.random.default_rng(seed)
            losses = np.where(random.random(units) < 0.15, random.beta(0.5, 1.0, units), 0.0)
            grid = np.arange(0.02, 0.3, 0.001)
            first = [next(e for e in grid if proved(losses, e)) for proved in (learned, tails)]
            found.append((loss_limit(losses, 0.99), *first))
    ours, bets, tailed = np.mean(found, axis=0)
    assert ours < 0.96 * bets and ours < 0.9 * tailed


def test_a_false_bound_is_proved_too_often_where_copies_count_as_vehicles() -> None:
    """The negative control of who is who: 60 vehicles that several scenes show, each counted five times."""
    assert np.mean([proves(np.tile(shares(60, seed), 5), 0.2, 0.9) for seed in range(500)]) > 0.13


def test_without_confidence_one_loss_is_added() -> None:
    assert proves(np.array([0.0, 0.5, 0.1]), 0.41, None) and not proves(np.array([0.0, 0.5, 0.1]), 0.39, None)
    assert units_needed(0.1, None) == 9


@pytest.mark.parametrize(("epsilon", "confidence"), [(0.1, 0.99), (0.3, 0.9), (1e-5, 0.99)])
def test_how_many_units_would_do(epsilon: float, confidence: float) -> None:
    needed = units_needed(epsilon, confidence)
    exact = np.log(1 - confidence) / np.log(1 - epsilon)  # of units that are missed or not
    assert exact <= needed < 1.1 * exact + 2
    assert proves(np.zeros(needed), epsilon, confidence) and not proves(np.zeros(needed - 1), epsilon, confidence)


@pytest.mark.parametrize("confidence", [None, 0.9])
def test_losses_so_many_times_prove_what_all_of_them_do(confidence: float | None) -> None:
    found = list[bool]()
    for seed in range(100):
        losses, times, epsilon = shares(20, seed), 1 + seed % 5, np.random.default_rng(seed).uniform(0.1, 0.5)
        found.append(proves(losses, epsilon, confidence, times))
        assert found[-1] is proves(np.tile(losses, times), epsilon, confidence)
    assert 10 < sum(found) < 90


def exceeding(unit: Unit, repeats: int = 2000, **how: float) -> float:
    """How often the rule of a calibration misses more windows than it claims."""
    return float(np.mean([threshold(alike(40, 1, 10, seed, **how), unit) > 0.2 for seed in range(repeats)]))


@pytest.mark.slow
def test_a_share_of_windows_is_bounded_although_windows_of_a_vehicle_are_alike() -> None:
    assert exceeding("share", by_vehicle=0.7) < 0.1
    assert exceeding("window", by_vehicle=0.7) > 0.15  # the negative control: as if windows were independent
    assert exceeding("window", by_vehicle=0.0) < 0.115


@pytest.mark.slow
def test_vehicles_of_a_new_group_are_bounded_although_vehicles_of_a_group_are_alike() -> None:
    def found(unit: Unit) -> float:
        samples = (alike(40, 10, 1, seed, by_group=0.7) for seed in range(2000))
        return float(np.mean([threshold(each, unit) > 0.2 for each in samples]))

    assert found("group") < 0.1
    assert found("vehicle") > 0.15  # the negative control: as if vehicles of one group were independent


@pytest.mark.slow
def test_on_average_over_calibrations_new_groups_are_bounded() -> None:
    samples = (alike(12, 10, 1, seed, by_group=0.7) for seed in range(2000))
    assert 0.15 < np.mean([threshold(each, "group", Claim(0.2, None)) for each in samples]) < 0.2


def test_far_fewer_vehicles_are_enough_than_for_one_window_each() -> None:
    share = np.mean([threshold(alike(60, 1, 20, seed, by_vehicle=0.3), "share") for seed in range(60)])
    alone = np.mean([threshold(alike(60, 1, 1, seed), "vehicle") for seed in range(60)])
    assert share > 1.1 * alone


def test_nested_rules_and_their_tests_agree() -> None:
    samples, training = alike(60, 1, 20, 0, by_vehicle=0.3), alike(60, 1, 20, 1, by_vehicle=0.3)
    training = replace(training, vehicle=training.vehicle + 1000)
    for unit in ("share", "group"):
        calibration = Calibration.of(samples, 1.0, NOBODY, unit, training=training)
        sets = quantile_sets(training)
        nested, _ = certify(Method.NESTED_SETS, calibration, CLAIM)
        tested = learn_then_test(calibration, CLAIM, [Thresholds.at(values, 1.0) for values in sets])
        assert isinstance(nested, Thresholds) and tested is not None
        assert nested.values.tolist() == tested.values.tolist()
        assert nested.values[0] > 0.001
        assert proves(losses(calibration, nested), 0.2, 0.9)


def test_too_few_groups_are_refused_with_how_many_would_do() -> None:
    needed = units_needed(0.2, 0.9)
    for count, said in ((3, "3 calibration scene groups"), (1, "1 calibration scene group")):
        few = Calibration.of(alike(count, 50, 5, 0), 1.0, NOBODY, "group")
        with pytest.raises(CertificateError, match=rf"{said} cannot prove ε = 0\.2; .*{needed} of them"):
            certify(Method.PAC_POOLED, few, CLAIM)
    alone = Calibration.of(alike(1, 1, 1, 0), 1.0, NOBODY, "vehicle")
    with pytest.raises(CertificateError, match=r"1 calibration vehicle cannot prove ε = 0\.2;"):
        certify(Method.PAC_POOLED, alone, CLAIM)
    enough = Calibration.of(alike(needed, 50, 5, 0), 1.0, NOBODY, "group")
    _, certificate = certify(Method.PAC_POOLED, enough, CLAIM)
    assert (certificate.samples, certificate.vehicles, certificate.scenes) == (needed, 50 * needed, needed)
    assert "a vehicle of a new scene group leaves its predicted set in any window" in certificate.sentence
    assert f"{needed} calibration scene groups of {50 * needed} vehicles" in certificate.sentence


def test_windows_outside_every_tube_are_lost_at_every_threshold() -> None:
    samples = alike(60, 1, 20, 0)
    far = replace(samples, distance=np.where(np.arange(len(samples)) % 20 < 2, 2.0, 0.0))
    assert 0 < threshold(far, "share") < threshold(samples, "share")
    with pytest.raises(CertificateError, match=r"60 calibration vehicles cannot prove ε = 0\.2: 0\.3 of them is lost"):
        threshold(replace(samples, distance=np.where(np.arange(len(samples)) % 20 < 6, 2.0, 0.0)), "share")


@pytest.mark.parametrize("method", [Method.POST_BLOATING, Method.DISCARDING, Method.PAC_PER_BASE])
def test_methods_that_count_bound_no_shares(method: Method) -> None:
    calibration = Calibration.of(alike(60, 1, 5, 0), 1.0, NOBODY, "share")
    with pytest.raises(CertificateError, match="bounds no shares"):
        certify(method, calibration, replace(CLAIM, epsilon=None) if method.computes_epsilon else CLAIM)


def test_observed_shares_and_groups_by_hand() -> None:
    """Vehicles 0 and 1 of group 7 miss 1/2 and none of their windows, vehicle 2 of group 8 both."""
    scores = np.array([[0.1], [0.9], [0.9], [0.9], [0.1], [0.2]])
    vehicle, group = np.array([0, 0, 1, 1, 2, 2]), np.array([7, 7, 7, 7, 8, 8])
    zero = np.zeros(6, dtype=np.int64)
    found = evaluate(Thresholds.at(np.array([0.5]), 1.0), ScoredSamples(scores, zero, 0.0 * zero, vehicle, None, group))
    assert (found.shares.value, found.groups.value) == (pytest.approx(0.5), pytest.approx(0.75))
    assert (found.missed("share"), found.missed("group")) == (found.shares, found.groups)


def test_a_vehicle_that_crosses_into_another_group_counts_in_its_first() -> None:
    """Vehicle 1 of group 0 is last seen in group 1, in which nobody else is."""
    vehicle, group, zero = np.array([0, 1, 1]), np.array([0, 0, 1]), np.zeros(3, dtype=np.int64)
    samples = ScoredSamples(np.array([[0.9], [0.9], [0.1]]), zero, 0.0 * zero, vehicle, None, group)
    rule, calibration = Thresholds.at(np.array([0.5]), 1.0), Calibration.of(samples, 1.0, NOBODY, "group")
    assert losses(calibration, rule).tolist() == [0.5]
    assert evaluate(rule, samples).groups.value == 0.5


def test_the_interval_of_a_mean_loss_holds() -> None:
    inside = [
        (found := Rate.of_losses(np.random.default_rng(seed).beta(0.3, 1.2, 50))).low <= 0.2 <= found.high
        for seed in range(300)
    ]
    assert np.mean(inside) > 0.93


def test_groups_that_share_a_vehicle_are_one() -> None:
    """As successive minutes of a recording are: they are no independent draws."""
    apart = alike(6, 50, 2, 0)
    assert apart.group is not None
    crossing = replace(apart, group=np.where(np.arange(len(apart)) == 0, apart.group.max(), apart.group))
    for each, count in ((apart, 6), (crossing, 5)):
        assert len(Calibration.of(each, 1.0, NOBODY, "group")) == count
        assert len(np.unique(each.scene)) == count


def test_the_design_effect_is_the_variance_between_groups() -> None:
    independent, linked = alike(20, 50, 1, 0), alike(20, 50, 1, 0, by_group=0.9)
    effects = [
        certify(Method.PAC_POOLED, Calibration.of(each, 1.0, NOBODY, "vehicle"), CLAIM)[1].design_effect
        for each in (independent, linked)
    ]
    assert effects[0] is not None and 0.3 < effects[0] < 2.2
    assert effects[1] is not None and effects[1] > 15
