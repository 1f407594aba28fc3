"""Why nothing clear was found at a step of a drive, told afterwards in words.

A plan is not clear because its fail-safe branch touches something, or leaves the road. Contact at any time is that of
`coverdrive.planning.check.evaluate`. n paths, K steps, P = K + 1 states.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.check.evaluate import first_contact
from coverdrive.planning.check.sweep import write_edges
from coverdrive.planning.problem.constants import Constants, constants_of
from coverdrive.planning.problem.obstacles import BRAKE_TO, FAR
from coverdrive.planning.problem.road_table import RoadTable, on_road, table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.road import Road
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.roads.initial import EGO

_OFF_ROAD = 0.01
"""[m] a smaller departure is not worth a word"""


class Reason(NamedTuple):
    """Why a plan is not clear."""

    text: str = ""
    """in one line; empty where the plan is clear"""
    path: int = -1
    """index of the path that it meets fastest; −1 for none"""
    time: float = 0.0
    """[s] from the start of the plan to the first contact with that path"""


def reason_of(trace: Trace, step: int) -> Reason:
    """Why the plan of a step is not clear."""
    plan, paths, scene = trace.plans[step], trace.paths[step], trace.scene
    if plan.status in (Status.SOLVED, Status.FALLBACK):
        return Reason()
    if plan.status is Status.INVALID_INPUT:
        return Reason("what was seen of the ego or of another vehicle cannot be true")
    size = float(scene.length[step, EGO]), float(scene.width[step, EGO])
    times, speeds, departure = first_contacts(plan, paths, trace.road, *size)
    met, path, said = int(np.isfinite(times).sum()), -1, list[str]()
    if met:
        path = int(np.lexsort((times, -speeds, np.isinf(times)))[0])
        when = f"in {times[path]:.1f} s" if times[path] > 0 else "now"
        who = where_is(trace, step, int(paths.vehicle[path]))
        which = f"{met} of {len(paths)} predicted paths{', hardest' if met > 1 else ':'} that of the vehicle {who}"
        said = [f"would meet {which}, {when}, at {speeds[path]:.1f} m/s"]
    if departure > _OFF_ROAD:
        said.append(f"would get {departure:.2f} m off the road")
    if not said and plan.severity > 0:
        said = [f"could not brake behind a vehicle after its end, {plan.severity:.1f} m/s too fast"]
    text = " and ".join(said) or "meets nothing that is seen now"
    return Reason(text, path, float(times[path]) if met else 0.0)


def where_is(trace: Trace, moment: int, slot: int) -> str:
    """Where a vehicle is, seen from the ego."""
    scene = trace.scene
    ahead = float(scene.lon[moment, slot] - scene.lon[moment, EGO])
    long = float(scene.length[moment, slot] + scene.length[moment, EGO]) / 2
    across = float(scene.lat[moment, slot] - scene.lat[moment, EGO])
    wide = float(scene.width[moment, slot] + scene.width[moment, EGO]) / 2
    lane, own = (int(trace.road.lane_at(scene.lon[moment, each], scene.lat[moment, each])) for each in (slot, EGO))
    along = "beside" if abs(ahead) <= long else "ahead" if ahead > 0 else "behind"
    if abs(across) < wide:
        return f"{along} {'in the same lane' if lane == own else 'partly in the same lane'}"
    return f"{along} on the {'left' if across > 0 else 'right'}"


class FirstContacts(NamedTuple):
    """What the fail-safe branch of a plan does within its horizon."""

    times: Float[np.ndarray, " n"]
    """[s] of its first contact with every path; infinite without one"""
    speeds: Float[np.ndarray, " n"]
    """[m/s] relative speed then; 0 without one"""
    departure: float
    """[m] that it gets off the road after the start; 0 if it keeps to it"""


def first_contacts(plan: Plan, paths: PredictedPaths, road: Road, length: float, width: float) -> FirstContacts:
    """What a plan of a car of this length and width [m] meets of these paths, which have its times."""
    steps, start = len(plan.states) - 1, np.array([plan.held[0, 0], 0.0, 0.0, 0.0])
    constants, table = _on(road, steps, plan.dt, length, width)
    states, boxes, edges = plan.held - start, np.zeros((7, steps + 1, len(paths))), np.empty((steps, 2, 4))
    half_sizes = on_road(paths, float(plan.held[0, 0]), table).half_sizes[: len(paths)]  # after these, where lanes end
    boxes[:2], boxes[2:4] = (paths.points - start[:2]).T, half_sizes.T
    boxes[BRAKE_TO] = FAR  # what comes after the end is not looked at
    inputs = np.diff(states[:, 2:], axis=0) / plan.dt
    write_edges(states, inputs, edges, constants)
    found = [first_contact(states, inputs, edges, slot, 1.0, 0.0, boxes, constants) for slot in range(len(paths))]
    times, speeds = np.array(found).reshape(-1, 2).T
    right, left = np.moveaxis(
        road.edges_at(np.stack([plan.held[:-1, 0], plan.held[1:, 0]], axis=-1))[..., [0, -1]], -1, 0
    )
    beyond = np.maximum(edges[..., 3] - left, right - edges[..., 1])
    later = beyond.ravel()[1:]  # where it is now, no plan changes
    speeds = np.where(np.isfinite(times), np.abs(speeds), 0.0)
    return FirstContacts(times * plan.dt, speeds, max(0.0, float(later.max())))


@lru_cache(maxsize=4)
def _on(road: Road, steps: int, dt: float, length: float, width: float) -> tuple[Constants, RoadTable]:
    """The constants of a plan, and the table of the road that it is on."""
    problem = ProblemSettings(steps=steps, dt=dt, vehicle=VehicleSettings(length=length, width=width))
    table = table_of(road, problem)
    return constants_of(problem, dt)._replace(vehicle=table.vehicle), table
