"""On which road, among how much traffic, and how fast at best the trials of a study were driven, in one sentence."""

from typing import Any

from coverdrive.percentages import counted
from coverdrive.planning.planner import MpcPlanner
from coverdrive.simulation.roads.initial import InitialSettings
from coverdrive.simulation.roads.places import PLACES, Place
from coverdrive.simulation.roads.settings import UNLIMITED
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings

_STRAIGHT = 5000.0
"""[m] a road of larger radii is straight to the eye"""


def driven_on(setup: Setup) -> str:
    """The sentence, for a study."""
    planner = setup.planner
    speed = planner.settings.problem.cost.reference_speed if isinstance(planner, MpcPlanner) else None
    wants = "" if speed is None else f"; the ego wants {speed:g} m/s"
    if setup.replays:
        react = ", who react" if isinstance(setup.traffic, ReactiveReplaySettings) else ""
        return f"Driven on the recorded roads, among the recorded vehicles{react}{wants}."
    start, traffic = setup.episode.initial, setup.traffic
    owners: tuple[Any, ...] = (traffic, getattr(traffic, "drivers", None), start)
    spread = next(each for each in owners if hasattr(each, "behind"))
    fewest, most = min(setup.vehicles), max(setup.vehicles)
    among = (f"{fewest} to " if fewest < most else "") + counted(most, "vehicle")
    among += f" within {spread.ahead - spread.behind:g} m, at {start.traffic_speed:g} m/s at the start"
    return f"Driven on {_which(start, setup.recorded)}: {_looks(start)}; among {among}{wants}."


def _which(start: InitialSettings, recorded: InitialSettings | None) -> str:
    """Whose road it is."""
    own = Place(initial=start).parts["episode"]
    if recorded and own == Place(initial=recorded).parts["episode"]:
        return "a road like the recorded one"
    names = [name for name, place in PLACES.items() if place.parts["episode"] == own]
    return {"paper": "the paper's road", "curved": "the road “curved”"}[names[0]] if names else "an own road"


def _looks(start: InitialSettings) -> str:
    straight = start.smallest_radius > _STRAIGHT
    looks = [f"{counted(start.lanes, 'straight ' * straight + 'lane')} of {start.lane_width:g} m"]
    looks += [] if straight else [f"bends of down to {start.smallest_radius:.0f} m radius"]
    looks += [f"an on-ramp whose lane ends after {start.ramp:g} m"] if start.ramp else []
    looks += [f"a limit of {start.speed_limit:g} m/s"] if start.speed_limit < UNLIMITED else []
    return ", ".join(looks)
