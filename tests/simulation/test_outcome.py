import numpy as np
from simulation_fakes import make_scene

from coverdrive.simulation.outcome import Kind, judge


def judged(before, after):
    """Two vehicles each: (lon, lat, speed, heading) of the ego, then of the other."""
    scenes = [make_scene(*np.array(states, dtype=float).T) for states in (before, after)]
    return judge(*scenes)


def test_the_ego_runs_into_the_one_ahead():
    before, after = [(0, 1.8, 25, 0), (5.0, 1.8, 20, 0)], [(2.5, 1.8, 25, 0), (7.0, 1.8, 20, 0)]
    assert judged(before, after) == (Kind.FRONTAL, 1)


def test_the_ego_is_hit_from_behind():
    before, after = [(0, 1.8, 20, 0), (-5.0, 2.2, 25, 0)], [(2.0, 1.8, 20, 0), (-2.5, 2.2, 25, 0)]
    assert judged(before, after) == (Kind.REAR_END, 1)


def test_contact_beside_is_from_the_side():
    before = [(0, 1.8, 20, 0.2), (1.0, 3.9, 20, 0.0)]
    after = [(2, 2.0, 20, 0.2), (3.0, 3.7, 20, 0.0)]
    assert judged(before, after) == (Kind.SIDE, 1)


def test_contact_out_of_a_diagonal_is_from_the_side():
    before = [(0, 1.8, 30, 0.1), (5.0, 3.9, 20, 0.0)]
    after = [(3, 2.1, 30, 0.1), (7.0, 3.9, 20, 0.0)]
    assert judged(before, after) == (Kind.SIDE, 1)


def test_contact_of_turned_bodies_side_by_side_is_from_the_side():
    before = [(0, 4.0, 20, 0.2), (4.5, 2.9, 20, 0.2)]  # 1.97 m beside each other, seen along their common heading
    after = [(2, 4.2, 20, 0.2), (6.5, 3.3, 20, 0.2)]
    assert judged(before, after) == (Kind.SIDE, 1)


def test_no_contact_and_contact_among_others_is_no_collision():
    apart = make_scene([0, 20, 22], [1.8, 1.8, 1.8])
    assert judge(apart, apart) is None


def test_slots_without_a_vehicle_cannot_be_hit():
    scene = make_scene([0, 1], [1.8, 1.8])
    scene.valid[1] = False
    assert judge(scene, scene) is None


def test_turned_bodies_are_judged_by_their_true_shape():
    beside = make_scene([0, 0], [1.8, 4.0], heading=[0.0, 0.3])
    assert judge(beside, beside) is not None
    straight = make_scene([0, 0], [1.8, 4.0])
    assert judge(straight, straight) is None
