"""Which lanelets make the road, on small networks drawn along the x axis."""

import pytest
from lanelet_fakes import ends, piece, side

from coverdrive.errors import DataError
from coverdrive.recordings.roads.lanelets import carriageways

TWO_LANES = [
    piece(1, 0, 100, 0.0, successor=[2], **side(right=11)),
    piece(2, 100, 250, 0.0, **side(right=12)),
    piece(11, 0, 100, -3.5, successor=[12], **side(left=1)),
    piece(12, 100, 250, -3.5, **side(left=2)),
]


def test_the_leftmost_lane_leads():
    guide, *others = next(carriageways(TWO_LANES))
    assert ends(guide) == [[0, 0], [250, 0]]
    assert [ends(other) for other in others] == [[[0, -3.5], [250, -3.5]]]


def test_a_longer_ramp_does_not():
    ramp = [piece(31, -60, 0, 10, 3.5), piece(32, 0, 100, 3.5, 0.0, successor=[2])]
    ramp[0].successor = [32]
    guide, *_ = next(carriageways([*ramp, *TWO_LANES]))
    assert ends(guide) == [[0, 0], [250, 0]]


def test_links_to_what_lies_elsewhere_are_no_links():
    wrong = [
        piece(1, 0, 100, 0.0, successor=[1, 2], predecessor=[3]),
        piece(2, 100, 200, 0.0),
        piece(3, 500, 900, 50.0),
    ]
    assert ends(next(carriageways(wrong))[0]) == [[500, 50], [900, 50]]
    assert ends(next(carriageways([*wrong[:2], piece(3, 500, 600, 50.0)]))[0]) == [[0, 0], [200, 0]]


def test_where_the_left_lane_ends_the_road_goes_straight_on():
    merge = [
        piece(1, 0, 100, 3.5, successor=[2], **side(right=11)),
        piece(2, 100, 130, 3.5, 0.0, successor=[3], **side(right=12)),
        piece(11, 0, 100, 0.0, successor=[12], **side(left=1)),
        piece(12, 100, 130, 0.0, successor=[3], **side(left=2)),
        piece(3, 130, 300, 0.0),
    ]
    guide, other = next(carriageways(merge))
    assert ends(guide) == [[0, 0], [300, 0]]
    assert ends(other) == [[0, 3.5], [130, 0]]


def test_one_carriageway_after_another():
    oncoming = [piece(51, 250, 0, 10.0, successor=[52]), piece(52, 0, -100, 10.0)]
    first, second, *rest = (ends(lanes[0]) for lanes in carriageways([*TWO_LANES, *oncoming]))
    assert (first, second, rest) == ([[0, 0], [250, 0]], [[250, 10], [-100, 10]], [])


def test_a_ring_is_a_chain():
    ring = [piece(1, 0, 100, 0.0), piece(2, 100, 200, 0.0)]
    ring[0].successor, ring[1].successor = [2], [2, 1]
    assert ends(next(carriageways(ring))[0]) == [[0, 0], [200, 0]]


def test_many_in_a_chain_take_linear_time(lines_run):
    def lines_for(count: int) -> int:
        chain = [piece(k, 30 * k, 30 * k + 30, 0.0, successor=[k + 1]) for k in range(count)]
        chain[-1].successor.clear()
        found: list[list[DrawnLane]] = []
        lines = lines_run(lambda: found.append(next(carriageways(chain))))
        assert ends(found[0][0]) == [[0, 0], [30 * count, 0]]
        return lines

    assert lines_for(500) < 6 * lines_for(100)


def test_more_lanelets_beside_one_another_than_any_road_has_are_refused():
    row = [piece(k, 0, 100, -3.5 * k, **side(right=k + 1)) for k in range(60)]
    with pytest.raises(DataError, match="lanelet 0 has more than 50 beside it"):
        next(carriageways(row))


@pytest.mark.parametrize(("links", "error"), [({"left": 1}, DataError), ({"left": 77}, KeyError)])
def test_wrong_neighbours_are_refused(links: dict[str, int], error: type[Exception]):
    with pytest.raises(error):
        next(carriageways([piece(1, 0, 100, 0.0, **side(**links))]))
