import numpy as np
from simulation_fakes import make_scene

from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from coverdrive.simulation.drives.outcome import Kind, contacts, judge


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


def test_contact_is_that_of_the_bodies_on_the_ground():
    """In a bend, 1 m of lon is less than 1 m on the inside of the line, and more outside."""
    bend = Road(np.arange(4) * 3.6, 300.0, ReferenceLine(np.zeros(2), 0.3, np.full(301, 1 / 100), 300.0, lat=5.4))
    outside, inside = (make_scene([100.0, 105.0], [lat, lat]) for lat in (0.5, 10.3))
    assert not contacts(outside).any() and not contacts(outside, bend).any()
    assert not contacts(inside).any() and contacts(inside, bend)[0, 1]  # 4.76 m on the ground
    assert judge(outside, inside, bend) == (Kind.FRONTAL, 1) and judge(outside, inside) is None
    turned = make_scene([100.0, 101.0], [2.0, 4.1], heading=[0.15, 0.0])
    straight = Road(bend.edges, 300.0, ReferenceLine(np.ones(2), 2.0, np.zeros(301), 300.0, lat=2.0))
    assert np.array_equal(contacts(turned, straight), contacts(turned))


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
