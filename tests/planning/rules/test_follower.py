import numpy as np

from coverdrive.paths import PredictedPaths
from coverdrive.planning.rules.follower import without_follower
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
