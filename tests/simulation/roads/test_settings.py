import numpy as np
import pytest

from coverdrive.config import Experiment
from coverdrive.errors import SettingError
from coverdrive.road import Road
from coverdrive.simulation.roads.settings import CURVED, TAPER, RoadSettings


def test_without_bends_and_ramp_it_is_a_straight_road() -> None:
    made, straight = RoadSettings(lanes=4, lane_width=3.5).road_of(800.0), Road.straight(4, 3.5, 800.0)
    assert np.array_equal(made.edges, straight.edges) and made.length == straight.length
    assert (made.line, made.changing, made.speed_limit) == (None, None, None)


def test_bends_are_where_they_are_said_to_be() -> None:
    road = RoadSettings(curvature=((100.0, 0.0), (200.0, 0.004), (300.0, 0.004), (340.0, -0.002))).road_of(1000.0)
    curvature = road.curvature(np.array([0.0, 100.0, 150.0, 250.0, 320.0, 900.0]))
    assert curvature == pytest.approx([0.0, 0.0, 0.002, 0.004, 0.001, -0.002], abs=1e-9)
    assert road.stretch(np.array([250.0]), np.array([5.4])) == 1.0  # measured in the middle
    x, y = road.to_map(np.array([0.0]), np.array([5.4]))
    assert (x[0], y[0]) == pytest.approx((0.0, 0.0))


def test_the_lane_of_the_ramp_is_the_rightmost_and_narrows_to_nothing() -> None:
    road = RoadSettings(lanes=2, lane_width=3.5, ramp=400.0).road_of(1000.0)
    lon = np.array([0.0, 400.0, 400.0 + TAPER / 2, 400.0 + TAPER, 900.0])
    assert road.edges_at(lon)[:, 0] == pytest.approx([0.0, 0.0, 1.75, 3.5, 3.5])
    assert road.edges_at(lon)[:, 1:] == pytest.approx(np.tile([3.5, 7.0, 10.5], (5, 1)))
    assert road.has_lane(lon)[:, 0].tolist() == [True, True, False, False, False]
    assert road.has_lane(lon)[:, 1:].all()


def test_the_curved_road_has_the_radii_of_its_description() -> None:
    road = CURVED.road_of(1600.0)
    assert 1 / road.curvature(np.array([450.0, 800.0, 1200.0])) == pytest.approx([400.0, -231.0, 300.0])
    assert CURVED.smallest_radius == pytest.approx(231.0)
    assert road.speed_limit == 22.4
    superelevation, friction = 0.08, 0.14  # AASHTO at 50 mph
    assert pytest.approx(superelevation + friction, abs=0.005) == 22.4**2 / 9.81 / 231


@pytest.mark.parametrize(
    ("curvature", "complaint"),
    [([[100.0, 0.01], [50.0, 0.0]], "must ascend"), ([[0.0, 0.03]], "less than or equal to 0.02")],
)
def test_impossible_bends_are_refused(curvature: list[list[float]], complaint: str) -> None:
    with pytest.raises(SettingError, match=complaint):
        Experiment().updated({"episode": {"initial": {"curvature": curvature}}})
