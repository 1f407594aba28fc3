"""Out of a lane that ends, among cars that yield to nobody: `python benchmarks/merging.py [--standing] [--scenes 300]`.

The right lane of a straight road ends 150 to 400 m ahead of the ego. On the next one, and on a third one in half of the
scenes, cars drive at 12 to 28 m/s, 0.7 to 2.5 s apart, and keep their speed whatever the ego does; it begins at theirs
±5 m/s. It is told where they are going to be, in boxes that grow by 1.3 m along the road in 3 s. A car that comes over
smoothly neither slows down to half of its own or their speed nor brakes harder than at 4 m/s². Beside the planner
stands the same one without the rule for such lanes, and what is possible in hindsight: to hold one acceleration
of at most 2 m/s² for some seconds, and to come over in the next 3 s, never nearer than 3 m. With ``--standing`` the
lane goes on, but a car stands in it, where it would end; the rule is the one about who is far slower.
"""

import argparse
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Planner, Status
from coverdrive.planning import planner
from coverdrive.planning.problem.vehicle import step
from coverdrive.road import LaneEdges, Road
from results import save

PERIOD, LONGEST, NEAR, STANDING_NEAR = 0.25, 26.0, 90.0, 200.0
"""[s] between plans, and of a drive; [m] within which others are seen, and where one of them stands"""
TIMES = 0.25 * np.arange(13)
CAR, EGO = np.array([2.25, 0.9]), np.array([2.4, 0.95])
GROWING = np.stack([0.25 * TIMES**1.5, 0.08 * TIMES], axis=-1)
START, LANE, LENGTH = 50.0, 3.6, 3000.0
HARD = 4.0
"""[m/s²]"""


class Scene(NamedTuple):
    """What a drive begins with."""

    road: Road
    state: np.ndarray
    centre: np.ndarray
    """lon, lat [m] of the others now (n, 2)"""
    speed: np.ndarray
    """[m/s] of the others (n)"""
    end: float
    """[m] where the lane begins to narrow, or somebody stands"""
    near: float = NEAR
    """[m] within which others are seen"""

    def at(self, time: float) -> np.ndarray:
        """Where the others are."""
        return self.centre + np.outer(self.speed * time, [1, 0])


def drawn(seed: int, standing: bool = False) -> Scene:
    """A scene, with a lane that ends or somebody who stands in it."""
    random = np.random.default_rng(seed)
    lanes, end = int(random.integers(2, 4)), START + random.uniform(150, 400)
    lat = np.tile(np.arange(lanes + 1) * LANE, (4, 1))
    lat[2:, 0] = LANE
    changing = LaneEdges(np.array([0.0, end, end + random.uniform(10, 60), LENGTH]), lat)
    speed = random.uniform(12, 28)
    places, speeds = list[tuple[float, float]](), list[float]()
    for lane in range(1, lanes):
        lon, own = START - 200.0, speed + (random.uniform(0, 3) if lane > 1 else 0.0)
        while (lon := lon + 5 + max(8.0, speed * random.uniform(0.7, 2.5))) < START + 350:
            places.append((lon, (lane + 0.5) * LANE))
            speeds.append(own)
    state = np.array([START, LANE / 2, speed + random.uniform(-5, 5), 0.0])
    if standing:
        places, speeds = [*places, (end + CAR[0], LANE / 2)], [*speeds, 0.0]
        return Scene(Road(lat[0], LENGTH), state, np.array(places), np.array(speeds), end, STANDING_NEAR)
    return Scene(Road(lat[0], LENGTH, changing=changing), state, np.array(places), np.array(speeds), end)


class Drive(NamedTuple):
    """What came of it."""

    merged: bool
    contact: bool
    least: float
    """lowest speed over that of the ego at the beginning, or of the others if they are slower"""
    hardest: float
    """[m/s²] braking"""
    unsafe: bool
    """whether a plan was"""

    @property
    def smooth(self) -> bool:
        """Whether it came over smoothly."""
        return self.merged and not self.contact and self.least > 0.5 and self.hardest < HARD


def driven(scene: Scene, planner: Planner) -> Drive:
    """Until a second after it has come over, or for the longest time."""
    planner.reset(PERIOD)
    state, least, hardest, unsafe, merged = scene.state, scene.state[2], 0.0, False, 0.0
    for k in range(round(LONGEST / PERIOD)):
        others = scene.at(k * PERIOD)
        seen = np.abs(others[:, 0] - state[0]) < scene.near
        points = others[seen, None] + np.multiply.outer(scene.speed[seen], TIMES)[..., None] * [1, 0]
        half_sizes = np.broadcast_to(CAR + GROWING, points.shape)
        plan = planner.plan(state, PredictedPaths(points, np.flatnonzero(seen), half_sizes, 0.25), scene.road)
        state = step(state, plan.inputs[0], PERIOD)
        least, hardest = min(least, state[2]), max(hardest, -plan.inputs[0, 0])
        unsafe |= plan.status is Status.UNSAFE
        if contact := bool((np.abs(scene.at((k + 1) * PERIOD) - state[:2]) < CAR + EGO).all(1).any()):
            break
        merged += PERIOD * bool(state[1] - EGO[1] > LANE)
        if merged > 1:
            break
    slowest = min(scene.state[2], scene.speed[scene.speed > 0].min())
    return Drive(merged > 1, contact, float(least / slowest), float(hardest), unsafe)


def possible(scene: Scene) -> bool:
    """Whether a simple manoeuvre comes over."""
    beside = (scene.centre[:, 1] < 2 * LANE) & (scene.speed > 0)
    for acceleration in (0, -0.5, 0.5, -1, 1, -1.5, 1.5, -2, 2):
        for hold in np.arange(0, 10, 0.5):
            time = np.arange(0, hold + 6, 0.1)
            speed = np.maximum(scene.state[2] + acceleration * np.minimum(time, hold), 1)
            lon = START + np.append(0, np.cumsum(speed[:-1] * 0.1))
            share = np.clip((time - hold) / 3, 0, 1)
            others = scene.centre[beside, :1] + scene.speed[beside, None] * time
            apart = np.abs(others - lon) - CAR[0] - EGO[0]
            if lon[share < 0.9].max() < scene.end and (apart[:, share > 0.25] >= 3).all():
                return True
    return False


def summary(drives: list[Drive]) -> dict[str, Any]:
    """What comes of the drives of one planner."""
    smooth = sum(each.smooth for each in drives)
    return {
        "smooth": [smooth / len(drives), *clopper_pearson(smooth, len(drives))],
        "never over": sum(not each.merged for each in drives),
        "contacts": sum(each.contact for each in drives),
        "unsafe": sum(each.unsafe for each in drives),
        "braked hard": sum(each.hardest >= HARD for each in drives),
        "least speed": float(np.mean([each.least for each in drives])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--standing", action="store_true", help="somebody stands in the lane, which does not end")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    given = parser.parse_args()
    scenes = [drawn(1000 * given.seed + each, given.standing) for each in range(given.scenes)]
    found: dict[str, Any] = {"scenes": len(scenes), "possible": sum(map(possible, scenes))}
    rule, nothing = ("approach", np.inf) if given.standing else ("merge", None)
    for name, what in {"planner": getattr(planner, rule), "without the rule": lambda *_: nothing}.items():
        with patch.object(planner, rule, what):
            found[name] = summary([driven(scene, planner.MpcPlanner()) for scene in scenes])
        print(name, found[name], flush=True)
    if given.save:
        save(given.save, found, given.seed)


if __name__ == "__main__":
    main()
