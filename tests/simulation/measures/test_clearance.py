import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulation_fakes import make_scene

from coverdrive.geometry import boxes_overlap
from coverdrive.road import Road
from coverdrive.simulation.traffic.set_sampling import clearance, directly_in_front, road_clearance

CAR = np.array([2.4, 0.95])


def states(lon, lat, heading=0.0):
    lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
    return np.stack([lon, lat, np.full(lon.shape, 20.0), np.full(lon.shape, heading)], -1)


def test_clearance_is_the_bumper_or_side_distance_at_the_closest_moment():
    path = states([[0, 1, 2]], 1.8)
    ahead, beside = states([[10, 9, 8]], 1.8), states([[0, 1, 2]], 5.4)
    assert clearance(path, CAR, ahead, CAR[None]) == pytest.approx([6.0 - 4.8])
    assert clearance(path, CAR, beside, CAR[None]) == pytest.approx([3.6 - 1.9])
    both = np.concatenate([ahead, beside])
    assert clearance(path, CAR, both, np.tile(CAR, (2, 1))) == pytest.approx([1.2])
    assert clearance(path, CAR, states([[3, 3, 3]], 1.8), CAR[None])[0] < 0


def test_without_others_the_clearance_is_infinite():
    assert clearance(states([[0, 1]], 1.8), CAR, np.zeros((0, 2, 4)), np.zeros((0, 2))) == [np.inf]


number = st.floats(-8, 8)
angle = st.floats(-0.5, 0.5)


@settings(max_examples=300, deadline=None)
@given(number, number, angle, angle)
def test_bodies_with_positive_clearance_do_not_overlap(lon, lat, heading, other_heading):
    one, other = states([[0.0]], 0.0, heading), states([[lon]], lat, other_heading)
    if clearance(one, CAR, other, CAR[None])[0] > 0:
        assert not boxes_overlap(
            one[0, 0, :2], np.asarray(heading), CAR, other[0, 0, :2], np.asarray(other_heading), CAR
        )


def test_road_clearance_counts_the_body():
    road = Road.straight()
    assert road_clearance(states([[0, 1]], [[1.8, 0.95]]), CAR, road) == pytest.approx([0.0])
    assert road_clearance(states([[0, 1]], [[1.8, 0.5]]), CAR, road) == pytest.approx([-0.45])
    assert road_clearance(states([[0, 1]], [[9.0, 10.8]]), CAR, road) == pytest.approx([-0.95])


def test_a_vehicle_off_the_road_may_come_back_but_not_go_further():
    road = Road.straight()
    assert road_clearance(states([[0, 1]], [[0.5, 0.7]]), CAR, road)[0] > 0
    assert road_clearance(states([[0, 1]], [[0.5, 0.4]]), CAR, road)[0] < 0


def test_the_ego_counts_only_where_it_is_the_nearest_ahead_in_the_lane():
    road = Road.straight()
    scene = make_scene([0, -10, -25, -10, 10], [1.8, 1.8, 1.8, 5.4, 1.8])
    assert directly_in_front(scene, road).tolist() == [False, True, False, False, False]


def test_slots_without_a_vehicle_hide_nothing():
    scene = make_scene([0, -10, -25], [1.8, 1.8, 1.8])
    scene.valid[1] = False
    assert directly_in_front(scene, Road.straight())[2]
