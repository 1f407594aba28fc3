"""Why nothing clear was found at a step of a drive, in words."""

from typing import NamedTuple

import numpy as np

from coverdrive.plan import Status
from coverdrive.reporting.first_contact import first_contacts
from coverdrive.simulation.initial import EGO
from coverdrive.simulation.trace import Trace

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
        most = ", hardest" if met > 1 else ":"
        said = [f"meets {met} of {len(paths)} paths{most} the vehicle {who}, {when}, at {speeds[path]:.1f} m/s"]
    if departure > _OFF_ROAD:
        said.append(f"gets {departure:.2f} m off the road")
    if not said and plan.severity > 0:
        said = [f"could not brake behind a vehicle after its end, {plan.severity:.1f} m/s too fast"]
    trusted = "if the vehicle behind does not brake: " if plan.status is Status.REAR else ""
    text = trusted + (" and ".join(said) or "meets nothing that is seen now")
    return Reason(text, path, float(times[path]) if met else 0.0)


def where_is(trace: Trace, moment: int, slot: int) -> str:
    """Where a vehicle is, seen from the ego."""
    scene = trace.scene
    ahead = float(scene.lon[moment, slot] - scene.lon[moment, EGO])
    long = float(scene.length[moment, slot] + scene.length[moment, EGO]) / 2
    lane, own = (int(trace.road.lane_at(scene.lon[moment, each], scene.lat[moment, each])) for each in (slot, EGO))
    along = "beside" if abs(ahead) <= long else "ahead" if ahead > 0 else "behind"
    return f"{along} {'in its lane' if lane == own else 'on the left' if lane > own else 'on the right'}"
