from dataclasses import replace

import pytest
from report_fakes import make_contents

from coverdrive.planning.planner import MpcPlanner
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.roads.initial import InitialSettings
from coverdrive.simulation.roads.places import PLACES, Place
from coverdrive.simulation.studies.driven_on import driven_on
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.replay import ReplaySettings

LIKE = Place(initial=InitialSettings(lanes=5, lane_width=3.4, traffic_speed=14.1), vehicles=(20, 30), wanted_speed=18.9)


def setup_of(initial: InitialSettings, **others) -> Setup:
    return Setup(make_contents({}).predictor, MpcPlanner(), episode=EpisodeSettings(initial=initial), **others)


def test_the_paper_and_named_roads() -> None:
    paper = driven_on(setup_of(InitialSettings()))
    assert paper == (
        "Driven on the paper's road: 3 straight lanes of 3.6 m; among 3 to 7 vehicles within 40 m, at 20 m/s at the "
        "start; the ego wants 40 m/s."
    )
    curved = driven_on(setup_of(PLACES["curved"].initial, traffic="drivers", recorded=LIKE.initial))
    for text in ("road “curved”", "bends of down to 231 m", "lane ends after 700 m", "limit of 22.4 m/s", "160 m"):
        assert text in curved


def test_a_road_like_the_recorded_one_is_told_from_an_own_one() -> None:
    like = setup_of(LIKE.initial, vehicles=(20,), traffic="mixed", recorded=LIKE.initial)
    assert driven_on(like).startswith("Driven on a road like the recorded one: 5 straight lanes of 3.4 m; among 20 ")
    own = LIKE.initial.model_copy(update={"lanes": 4})
    assert driven_on(setup_of(own, recorded=LIKE.initial)).startswith("Driven on an own road: 4 straight lanes")
    assert driven_on(setup_of(LIKE.initial)).startswith("Driven on an own road")


def test_replayed_traffic_has_its_own_roads() -> None:
    said = driven_on(setup_of(LIKE.initial, traffic=ReplaySettings(), recorded=LIKE.initial))
    assert said == "Driven on the recorded roads, among the recorded vehicles; the ego wants 40 m/s."


@pytest.mark.parametrize("planner", [object, lambda: None])
def test_another_planner_wants_nothing_that_is_known(planner) -> None:
    said = driven_on(replace(setup_of(InitialSettings()), planner=planner))
    assert said.endswith("at the start.")
