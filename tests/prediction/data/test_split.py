"""No vehicle and no scene on two sides."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from coverdrive.errors import DataError
from coverdrive.prediction.data.split import SplitSettings, rotations, split


def sides_of(values: np.ndarray, sides: list[np.ndarray]) -> list[set[int]]:
    return [set(values[side].tolist()) for side in sides]


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 12)), min_size=30, max_size=300), st.integers(0, 99))
def test_sides_share_neither_vehicles_nor_groups(rows: list[tuple[int, int]], seed: int) -> None:
    vehicle, group = np.array(rows).T
    try:
        result = split(vehicle, group, seed=seed)
    except DataError:
        return
    if result.crossed:  # of two groups, the one that calibrates also tests
        assert len(np.unique(group)) == 2
        result = replace(result, test=result.test[:0])
    sides = [result.train, result.calibration, result.test]
    for values in (vehicle, group):
        first, second, third = sides_of(values, sides)
        assert not first & second and not second & third and not first & third
    assert sum(map(len, sides)) + result.dropped == len(rows)


def test_independent_scenes_are_dealt_out_whole_in_the_given_shares() -> None:
    group = np.repeat(np.arange(20), 50)
    vehicle = np.arange(1000)
    result = split(vehicle, group, SplitSettings(train=0.5, calibration=0.25), seed=1)
    assert (len(result.train), len(result.calibration), len(result.test), result.dropped) == (500, 250, 250, 0)
    other = split(vehicle, group, seed=2)
    assert not np.array_equal(result.train, other.train)
    assert np.array_equal(other.train, split(vehicle, group, seed=2).train)


def test_no_side_stays_empty_where_the_shares_would_be_nearer_then() -> None:
    group = np.repeat(np.arange(3), [66, 26, 8])
    result = split(np.arange(100), group, SplitSettings(train=0.6, calibration=0.35))
    assert (len(result.train), len(result.calibration), len(result.test)) == (66, 26, 8)


def test_one_long_recording_is_cut_in_time() -> None:
    """Blocks of a minute; every vehicle is seen for half a minute and may cross a border."""
    start = np.sort(np.random.default_rng(0).uniform(0, 600, 400))
    time = start[:, None] + np.linspace(0, 30, 10)
    vehicle = np.repeat(np.arange(400), 10)
    group = (time // 60).astype(int).ravel()
    result = split(vehicle, group, seed=3)
    last = [time.ravel()[side].max() for side in (result.train, result.calibration)]
    first = [time.ravel()[side].min() for side in (result.calibration, result.test)]
    assert last[0] <= first[0] and last[1] <= first[1]
    assert 0 < result.dropped < 0.1 * len(vehicle)


def test_rotations_give_every_part_every_role() -> None:
    group, vehicle = np.repeat(np.arange(8), 25), np.arange(200) // 5
    found = rotations(vehicle, group, 4, seed=0)
    roles = [
        tuple(frozenset(each) for each in sides_of(group, [side.train, side.calibration, side.test])) for side in found
    ]
    assert len(set(roles)) == 12
    parts = {calibration for _, calibration, _ in roles}
    assert len(parts) == 4 and {test for _, _, test in roles} == parts and frozenset().union(*parts) == set(range(8))
    for train, calibration, test in roles:
        assert not calibration & test and train == set(range(8)) - calibration - test
    with pytest.raises(DataError, match="at least 3 folds, got 2"):
        rotations(vehicle, group, 2)


def test_too_few_groups_are_refused() -> None:
    with pytest.raises(DataError, match="at least two groups of scenes that share no vehicle, got 1"):
        split(np.arange(10), np.zeros(10, dtype=int))


def test_of_two_groups_the_one_with_more_vehicles_calibrates_and_tests() -> None:
    vehicle, group = np.arange(10), np.arange(10) // 6
    found = split(vehicle, group)
    assert found.crossed and group[found.calibration].tolist() == [0] * 6 and group[found.train].tolist() == [1] * 4
    back, forth = rotations(vehicle, group, 4)
    assert back.train.tolist() == forth.calibration.tolist() and forth.train.tolist() == back.calibration.tolist()


def test_shares_must_leave_a_test_split() -> None:
    with pytest.raises(ValidationError, match="less than 1"):
        SplitSettings(train=0.7, calibration=0.3)
