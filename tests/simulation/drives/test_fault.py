"""Bodies are 4.8 m × 1.9 m: they overlap across the road where their centres are less than 1.9 m apart.

A vehicle that is 6 m/s faster needs 6 · 0.4 + 6² / (2 · 3) = 8.4 m between the bumpers, or 13.2 m between the centres.
"""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fakes import make_scene

from coverdrive.simulation.drives.fault import fault_of
from coverdrive.simulation.drives.outcome import Fault, Kind

TILT = 0.05
"""[rad] heading of whoever changes lanes"""
TILTED = 13.2 - (2.4 - (2.4 * np.cos(TILT) + 0.95 * np.sin(TILT)))
"""[m] between the centres if one of the two is tilted"""


def scenes(*moments):
    """Two vehicles at every moment: (lon, lat, speed, heading) of the ego, then of the other."""
    return [make_scene(*np.array(states, dtype=float).T) for states in moments]


def cut_in(distance, speed_behind=26.0, tilt=TILT):
    """The one ahead at 20 m/s comes over from the left, within the second step; then it is run into.

    First the one ahead, then the one behind; to lat 3.4 from a lane whose middle is 3.6 m from that of the other.
    """
    behind = (0.0, 1.8, speed_behind, 0.0)
    speed = 20.0 / np.cos(tilt)
    return [
        [(distance - 2.0, 5.4, speed, -tilt), (-2.6, 1.8, speed_behind, 0.0)],
        [(distance, 3.4, speed, -tilt), behind],
        [(5.0, 1.9, 20.0, 0.0), behind],
    ]


def swapped(moments):
    return [[second, first] for first, second in moments]


@pytest.mark.parametrize(("spare", "own"), [(-0.01, True), (0.01, False)])
def test_who_cuts_in_too_near_is_at_fault(spare, own):
    hit = cut_in(TILTED + spare)
    assert fault_of(Kind.REAR_END, 1, scenes(*hit)) is (Fault.EGO if own else Fault.OTHER)
    assert fault_of(Kind.FRONTAL, 1, scenes(*swapped(hit))) is (Fault.OTHER if own else Fault.EGO)


def test_what_counts_is_the_gap_when_the_bodies_began_to_overlap():
    late, early = cut_in(TILTED + 5.0), cut_in(TILTED - 5.0)
    assert fault_of(Kind.REAR_END, 1, scenes(early[0], late[1], late[2])) is Fault.OTHER
    assert fault_of(Kind.REAR_END, 1, scenes(late[0], early[1], late[2])) is Fault.EGO


def test_who_follows_from_the_start_is_at_fault():
    _, *rest = cut_in(TILTED - 5.0)
    assert fault_of(Kind.REAR_END, 1, scenes(*rest)) is Fault.OTHER
    assert fault_of(Kind.FRONTAL, 1, scenes(*swapped(rest))) is Fault.EGO


def test_only_the_last_time_that_it_came_into_the_way_counts():
    near, far = cut_in(TILTED - 5.0), cut_in(TILTED + 5.0)
    assert fault_of(Kind.REAR_END, 1, scenes(*near[:2], *far)) is Fault.OTHER


def test_a_vehicle_that_appears_in_the_way_has_not_cut_in():
    beside, *rest = scenes(*cut_in(TILTED - 5.0))
    absent = replace(beside, valid=np.array([True, False]))
    assert fault_of(Kind.REAR_END, 1, [beside, *rest]) is Fault.EGO
    assert fault_of(Kind.REAR_END, 1, [absent, *rest]) is Fault.OTHER


def test_who_moves_behind_another_and_into_it_is_at_fault():
    """The one behind comes over, whose gap is as small as that of the cut-in."""
    moments = [
        [(8.0, 5.4, 20.0, 0.0), (0.0, 1.8, 26.0, TILT)],
        [(8.0, 5.4, 20.0, 0.0), (0.0, 3.8, 26.0, TILT)],
        [(5.0, 5.4, 20.0, 0.0), (0.0, 5.0, 26.0, 0.0)],
    ]
    assert fault_of(Kind.REAR_END, 1, scenes(*moments)) is Fault.OTHER
    assert fault_of(Kind.FRONTAL, 1, scenes(*swapped(moments))) is Fault.EGO


def test_of_two_that_come_together_it_is_the_faster_one():
    def both(ahead, behind):
        first, second, last = cut_in(TILTED - 5.0, tilt=ahead)
        second[1] = (0.0, 1.8, 26.0, behind)
        return fault_of(Kind.REAR_END, 1, scenes(first, second, last))

    assert both(ahead=0.05, behind=0.03) is Fault.EGO  # 1.00 m/s against 0.78 m/s
    assert both(ahead=0.05, behind=0.05) is Fault.OTHER  # 1.00 m/s against 1.30 m/s
    assert both(ahead=0.0, behind=0.0) is Fault.OTHER


def test_a_cut_in_in_front_of_one_that_is_no_faster_asks_for_nothing():
    hit = cut_in(5.0, speed_behind=20.0)
    hit[2][1] = (0.0, 1.8, 26.0, 0.0)
    assert fault_of(Kind.REAR_END, 1, scenes(*hit)) is Fault.OTHER


def test_who_had_braked_for_a_cut_in_in_time_is_at_fault_later():
    first, second, last = cut_in(TILTED - 5.0)
    braked = [(5.5, 1.9, 20.0, 0.0), (0.0, 1.8, 19.9, 0.0)]
    still_faster = [(5.5, 1.9, 20.0, 0.0), (0.0, 1.8, 20.1, 0.0)]
    assert fault_of(Kind.REAR_END, 1, scenes(first, second, braked, last)) is Fault.OTHER
    assert fault_of(Kind.REAR_END, 1, scenes(first, second, still_faster, last)) is Fault.EGO


@pytest.mark.parametrize(
    ("own_heading", "other_heading", "fault"),
    [
        (0.2, 0.0, Fault.EGO),
        (0.0, -0.2, Fault.OTHER),
        (0.1, -0.2, Fault.OTHER),
        (0.2, -0.1, Fault.EGO),
        (0.2, 0.1, Fault.EGO),
        (0.0, 0.0, Fault.NONE),
        (0.1, -0.1, Fault.NONE),
    ],
)
def test_contact_beside_is_the_fault_of_the_faster_mover(own_heading, other_heading, fault):
    left = scenes([(0, 1.8, 20, own_heading), (1.0, 3.9, 20, other_heading)])
    right = [scene.mirrored() for scene in left]
    assert fault_of(Kind.SIDE, 1, left) is fault
    assert fault_of(Kind.SIDE, 1, right) is fault
