"""Windows are told apart by what vehicles do in them."""

import numpy as np
from prediction_fakes import recording_of

from coverdrive.prediction.data.manoeuvres import MANOEUVRES, gets_in_the_way, manoeuvres, manoeuvres_of
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.fit import Fit

TIME = 0.1 * np.arange(31)
USUAL = {"lon": 100 + 20 * TIME, "lat": 1.8}


def found(*others: dict[str, object], **own: object) -> str:
    """The manoeuvre of the first of some vehicles in its only window; others keep 20 m/s."""
    tracks = []
    for each in (own, *others):
        lon, lat = (np.broadcast_to(each.get(name, usual), 31) for name, usual in USUAL.items())
        along, across = np.gradient(lon, 0.1), np.gradient(lat, 0.1)
        speed, heading = np.hypot(along, across), np.arctan2(across, along)
        tracks.append({"lon": lon, "lat": lat, "speed": speed, "heading": heading})
    recording = recording_of(tracks)
    segments = cut_segments([recording])
    kinds = manoeuvres_of([recording], segments)
    assert (np.sum(list(kinds.values()), 0) == 1).all()
    return next(name for name, own in kinds.items() if own[segments.row == 0][0])


def test_each_manoeuvre_by_hand() -> None:
    change = 1.8 + 1.2 * TIME
    assert found() == "rest"
    assert found(lat=1.8 + 0.4 * TIME) == "rest"
    assert found(lat=change) == "lane_change"
    assert found(lon=100 + 20 * TIME - TIME**2) == "hard"
    assert found(lon=100 + 20 * TIME + TIME**2, lat=change) == "lane_change"
    behind, ahead, far = ({"lon": place + 20 * TIME, "lat": 5.4} for place in (80.0, 120.0, 40.0))
    assert found(behind, lat=change) == "cut_in"
    assert found(ahead, lat=change) == found(far, lat=change) == "lane_change"
    assert found({"lon": 80 + 20 * TIME}, lat=change) == "lane_change"  # it leaves the way of that one
    assert found(behind) == "rest"


def test_who_was_in_the_way_before_does_not_get_into_it() -> None:
    other = np.array([[[0.0, 0.0]], [[60.0, 0.0]]])
    from_beside, from_ahead = (np.array([[[20.0, lat]], [[80.0, 0.0]]]) for lat in (3.6, 1.0))
    assert gets_in_the_way(from_beside, other, np.array([1.9])).tolist() == [True]
    assert gets_in_the_way(from_ahead, other, np.array([1.9])).tolist() == [False]
    assert gets_in_the_way(from_beside[::-1], other, np.array([1.9])).tolist() == [False]


def test_kinds_of_a_fit_add_up(fitted: Fit) -> None:
    for each in (fitted.evaluation, fitted.driven):
        assert set(each.kinds) <= set(MANOEUVRES)
        assert sum(rate.count for rate in each.kinds.values()) == each.windows.count
        assert sum(rate.total for rate in each.kinds.values()) == each.windows.total


def test_names_are_those_of_all_kinds() -> None:
    kinds = manoeuvres(np.zeros((3, 2)), np.ones(3, dtype=bool))
    assert list(kinds) == list(MANOEUVRES) and kinds["rest"].all()
