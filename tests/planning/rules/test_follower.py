from dataclasses import replace

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.planning.rules.follower import FollowerSettings, with_careful_follower, without_follower
from coverdrive.road import Road

STATE = np.array([0.0, 5.4, 20.0, 0.0])


def twice(paths: PredictedPaths) -> PredictedPaths:
    """Two paths for every vehicle, the second faster than the first."""
    faster = paths.points + np.array([1.0, 0.0]) * np.linspace(0, 1, paths.points.shape[1])[:, None] ** 2
    return PredictedPaths(
        np.concatenate([paths.points, faster]),
        np.tile(paths.vehicle, 2),
        np.tile(paths.half_sizes, (2, 1, 1)),
        paths.dt,
    )


def test_without_follower_drops_the_nearest_behind_in_the_lane(straight_paths) -> None:
    paths = twice(straight_paths((-30, 5.0, 20), (-10, 5.8, 20), (-5, 1.8, 20), (20, 5.4, 20)))
    kept = without_follower(STATE, paths, Road.straight())
    np.testing.assert_array_equal(kept.vehicle, [0, 2, 3, 0, 2, 3])
    nobody = straight_paths((-5, 1.8, 20), (20, 5.4, 20))
    assert len(without_follower(STATE, nobody, Road.straight())) == 2


def test_a_careful_follower_reacts_then_brakes_then_stands(straight_paths) -> None:
    paths = twice(straight_paths((-10, 5.8, 4), (-5, 1.8, 20), (20, 5.4, 20)))
    paths.half_sizes[:, 1:] += 1.0
    got = with_careful_follower(STATE, paths, Road.straight(), FollowerSettings(reaction=0.5, deceleration=2.0))
    assert got is not None
    assert sorted(got.vehicle.tolist()) == [0, 1, 1, 2, 2]
    mine = got.vehicle == 0
    time = 0.25 * np.arange(13)
    by_hand = [-10 + sum(max(0.0, 4 - 2 * max(0.0, t - 0.5)) * 0.001 for t in np.arange(0, end, 0.001)) for end in time]
    np.testing.assert_allclose(got.points[mine][0, :, 0], by_hand, atol=0.01)
    np.testing.assert_array_equal(got.points[mine][0, :, 1], 5.8)
    np.testing.assert_array_equal(got.half_sizes[mine][0], np.tile(paths.half_sizes[0, 0], (13, 1)))
    others = paths.vehicle != 0
    np.testing.assert_array_equal(got.points[~mine], paths.points[others])
    stopped = with_careful_follower(STATE, paths, Road.straight(), FollowerSettings(reaction=0.5, deceleration=8.0))
    assert stopped is not None
    assert stopped.points[stopped.vehicle == 0][0, -4:, 0] == pytest.approx(-10 + 4 * 0.5 + 4**2 / 16)


def test_nobody_behind_no_careful_follower(straight_paths) -> None:
    paths = straight_paths((-5, 1.8, 20), (20, 5.4, 20))
    assert with_careful_follower(STATE, paths, Road.straight(), FollowerSettings()) is None


def test_the_others_keep_their_weights(straight_paths) -> None:
    paths = replace(twice(straight_paths((-10, 5.8, 4), (20, 5.4, 20))), weight=np.array([0.4, 0.3, 0.6, 0.7]))
    got = with_careful_follower(STATE, paths, Road.straight(), FollowerSettings())
    assert got is not None
    np.testing.assert_array_equal(got.weight, [0.4, 0.3, 0.7])
