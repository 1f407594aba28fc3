"""Lane changes that are under way: a second path where the learned box ends, none elsewhere."""

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.prediction.boxes.under_way import lane_changes
from coverdrive.scene import Scene

LENGTH, WIDTH = 4.6, 1.9
TIMES = 0.25 * np.arange(13)


def scene_of(*lateral_speeds: float) -> Scene:
    """Vehicles at 20 m/s along the road, 30 m apart, with these lateral speeds [m/s]."""
    n, across = len(lateral_speeds), np.array(lateral_speeds)
    speed, heading = np.hypot(20.0, across), np.arctan2(across, 20.0)
    return Scene(
        30.0 * np.arange(n),
        np.full(n, 5.4),
        speed,
        heading,
        np.full(n, LENGTH),
        np.full(n, WIDTH),
        np.ones(n, dtype=bool),
    )


def boxes_of(scene: Scene, beyond: float) -> PredictedPaths:
    """Boxes that go on along the road, this far [m] beyond the bodies across it at the horizon."""
    states = scene.states
    points = np.stack([states[:, :1] + 20.0 * TIMES, np.repeat(states[:, 1:2], len(TIMES), axis=1)], axis=-1)
    half_sizes = np.empty_like(points)
    half_sizes[..., 0], half_sizes[..., 1] = LENGTH / 2 + 3.0, WIDTH / 2 + beyond * TIMES / TIMES[-1]
    return PredictedPaths(points, np.arange(len(states)), half_sizes, TIMES[1])


def test_whoever_stays_in_its_box_has_no_second_path() -> None:
    scene = scene_of(0.0, 0.3, -0.3)
    assert len(lane_changes(boxes_of(scene, 1.5), scene)) == 0


def test_who_leaves_it_has_one_that_holds_every_lane_change_between_the_two() -> None:
    scene = scene_of(0.0, 0.9, -0.9)
    boxes = boxes_of(scene, 1.5)
    paths = lane_changes(boxes, scene)
    assert paths.vehicle.tolist() == [1, 2]
    assert paths.weight is not None and paths.weight.max() < 1
    for path, side in ((0, 1.0), (1, -1.0)):
        for swing in (0.0, 0.3, 0.6):
            lat = 5.4 + side * np.minimum(0.9 * TIMES + swing / 2 * TIMES**2, 3.6)
            half_width = paths.half_sizes[path, :, 1]
            assert np.all(np.abs(lat - paths.points[path, :, 1]) + WIDTH / 2 <= half_width + 1e-9)
        outside = paths.points[path, :, 1] * side - paths.half_sizes[path, :, 1]
        assert outside[-1] > side * 5.4 - WIDTH / 2 - 0.3  # it has left its place by then
    assert paths.points[..., 0] == pytest.approx(boxes.points[1:3, :, 0])


def test_nobody_comes_farther_than_a_lane() -> None:
    scene = scene_of(2.5)
    paths = lane_changes(boxes_of(scene, 0.5), scene)
    left = paths.points[0, :, 1] + paths.half_sizes[0, :, 1]
    body = abs(np.sin(scene.heading[0])) * LENGTH / 2 + np.cos(scene.heading[0]) * WIDTH / 2
    assert left.max() == pytest.approx(5.4 + 3.6 + body)


def test_who_crosses_the_road_goes_on_across_it() -> None:
    n = 2
    scene = Scene(
        np.array([0.0, 50.0]), np.array([-4.0, -4.0]), np.array([6.0, 6.0]), np.array([np.pi / 2, 2.0]),
        np.full(n, LENGTH), np.full(n, WIDTH), np.ones(n, dtype=bool),
    )  # fmt: skip
    paths = lane_changes(boxes_of(scene, 0.5), scene)
    assert paths.vehicle.tolist() == [0, 1]
    for path, heading in enumerate(scene.heading):
        lon = scene.lon[path] + 6.0 * np.cos(heading) * TIMES
        lat = scene.lat[path] + 6.0 * np.sin(heading) * TIMES
        extents = [[abs(np.cos(heading)), np.sin(heading)], [np.sin(heading), abs(np.cos(heading))]] @ np.array(
            [LENGTH / 2, WIDTH / 2]
        )
        body = np.abs(np.stack([lon, lat], axis=-1) - paths.points[path]) + extents
        assert np.all(body <= paths.half_sizes[path] + 1e-9)


@pytest.mark.parametrize(("speed", "heading"), [(0.01, np.pi / 2), (0.3, 0.6), (0.1, -0.6)])
def test_who_creeps_askew_comes_no_farther_than_a_lane(speed: float, heading: float) -> None:
    one = np.ones(1)
    scene = Scene(0 * one, 5.4 * one, speed * one, heading * one, LENGTH * one, WIDTH * one, one > 0)
    points = np.tile([0.0, 5.4], (1, 25, 1))
    paths = lane_changes(PredictedPaths(points, np.zeros(1, int), np.ones_like(points), 0.25), scene)
    body = abs(np.sin(heading)) * LENGTH / 2 + np.cos(heading) * WIDTH / 2
    reach = np.abs(paths.points[..., 1] - 5.4) + paths.half_sizes[..., 1] - body
    assert len(paths) == 1 and reach.min() >= 0 and reach.max() == pytest.approx(3.6)
