"""Is the planner ever worse than full braking in the lane? `python benchmarks/emergency.py [--out emergency.json]`.

In every scene the true future of the others is known to the planner. The car plans every 0.1 s; its motion is
followed every 10 ms, and so are the contacts of the bodies, as rectangles: that of the ego turns. The baseline brakes
at 8 m/s² in its lane from the first moment. A drive counts the largest relative speed at its first contact with any
of the others, 0 without contact.

- *blocked*: one lane, or all three, by standing cars, motorcycles, or cars that brake to a stop at 8 m/s².
- *cut-in*: a slower car comes over from the side, 1 s long, and stays ahead.
- *squeeze*: cars on both sides come over at the same time, by a part of the lane, and one ahead brakes.
- *follower*: a car stands ahead, and one behind brakes at 6 m/s², 1 s late.
"""

import argparse
import itertools
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverdrive.geometry import boxes_overlap
from coverdrive.paths import PredictedPaths
from coverdrive.planning.planner import MpcPlanner
from coverdrive.road import Road

PERIOD, SMALL, LONGEST = 0.1, 0.01, 12.0
OWN = np.array([2.4, 0.95])
CAR, MOTORCYCLE = np.array([2.25, 0.9]), np.array([1.1, 0.4])
SPEEDS = (15.0, 25.0, 36.0, 45.0)


class Other(NamedTuple):
    """One of the others: where it is [m] along and across the road at given times [s], and its half sizes [m]."""

    lon: Callable[[np.ndarray], np.ndarray]
    lat: Callable[[np.ndarray], np.ndarray]
    half: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Where it is [m]."""
        return np.stack([self.lon(time), self.lat(time)], axis=-1)


class Scene(NamedTuple):
    """What a drive begins with."""

    kind: str
    lanes: int
    lane: int
    speed: float
    others: list[Other]


def driving(lon: float, speed: float, deceleration: float = 0.0, after: float = 0.0) -> Callable:
    """Keeps its speed [m/s], and from a time [s] on brakes to a stop."""

    def at(time: np.ndarray) -> np.ndarray:
        lost = np.clip(time - after, 0.0, speed / deceleration if deceleration else 0.0)
        kept = np.minimum(time, after) if deceleration else time
        return lon + speed * kept + (speed - deceleration / 2 * lost) * lost

    return at


def moving_over(first: float, last: float, begin: float, duration: float = 1.0) -> Callable:
    """Moves across the road evenly, from one lat [m] to another."""
    return lambda time: first + (last - first) * np.clip((time - begin) / duration, 0.0, 1.0)


def centre(lane: int) -> float:
    return 1.8 + 3.6 * lane


def staying(lane: int) -> Callable:
    return lambda time: np.full_like(time, centre(lane))


def blocked(stride: float) -> Iterator[Scene]:
    for kind, lanes, speed in itertools.product(("standing", "braking", "motorcycle"), (1, 3), SPEEDS):
        half, start = MOTORCYCLE if kind == "motorcycle" else CAR, 0.7 * speed if kind == "braking" else 0.0
        for gap in np.arange(8.0, speed**2 / 16 + 25, stride):
            others = [Other(driving(gap, start, 8.0), staying(lane), half) for lane in range(lanes)]
            yield Scene("blocked", lanes, lanes // 2, speed, others)


def cut_ins(stride: float) -> Iterator[Scene]:
    for speed, slower, begin, side in itertools.product(SPEEDS, (5.0, 12.0), (0.0, 0.8), (0, 2)):
        for gap in np.arange(6.0, 40.0, stride):
            over = moving_over(centre(side), centre(1), begin)
            yield Scene("cut-in", 3, 1, speed, [Other(driving(gap, speed - slower, 2.0, 1.0), over, CAR)])


def squeezes(stride: float) -> Iterator[Scene]:
    for speed, part, begin in itertools.product(SPEEDS, (0.4, 0.6), (0.0, 0.8)):
        for gap in np.arange(8.0, 60.0, stride):
            sides = []
            for lane, lon in ((0, 4.0), (2, -3.0)):
                over = moving_over(centre(lane), centre(lane) + part * (centre(1) - centre(lane)), begin)
                sides.append(Other(driving(lon, speed - 2), over, CAR))
            yield Scene("squeeze", 3, 1, speed, [*sides, Other(driving(gap, 0.8 * speed, 6.0), staying(1), CAR)])


def followers(stride: float) -> Iterator[Scene]:
    for speed, behind in itertools.product(SPEEDS, (8.0, 14.0, 25.0)):
        for gap in np.arange(10.0, speed**2 / 16 + 25, stride):
            ahead = Other(driving(gap, 0.0), staying(0), CAR)
            yield Scene("follower", 1, 0, speed, [ahead, Other(driving(-behind, speed, 6.0, 1.0), staying(0), CAR)])


def impact(drive: Callable, scene: Scene) -> float:
    """Largest relative speed [m/s] at a first contact with one of the others; `drive(state, now)` gives the inputs."""
    state, now = np.array([0.0, centre(scene.lane), scene.speed, 0.0]), 0.0
    untouched, worst = list(scene.others), 0.0
    while now < LONGEST and (state[2] > 0.05 or scene.kind == "follower") and untouched:
        acceleration, yaw_rate = drive(state, now)
        velocities, motion, times = [], [], [now]
        for _ in range(round(PERIOD / SMALL)):
            velocity = state[2] * np.array([np.cos(state[3]), np.sin(state[3])])
            state = state + SMALL * np.array([*velocity, acceleration, yaw_rate])
            state[2] = max(state[2], 0.0)
            velocities.append(velocity)
            motion.append(state)
            times.append(times[-1] + SMALL)
        now, followed = times[-1], np.array(motion)
        for other in untouched.copy():
            there = other.at(np.array([*times[1:], now + SMALL]))
            still = np.zeros(len(followed))
            hit = boxes_overlap(followed[:, :2], followed[:, 3], OWN, there[:-1], still, other.half)
            if hit.any():
                first = hit.argmax()
                moved = np.diff(there, axis=0)[first] / SMALL
                worst = max(worst, float(np.linalg.norm(velocities[first] - moved)))
                untouched.remove(other)
    return worst


def planned(planner: MpcPlanner, scene: Scene) -> Callable:
    planner.reset(PERIOD)
    road, time = Road.straight(scene.lanes), planner.dt * np.arange(planner.steps + 1)

    def drive(state: np.ndarray, now: float) -> np.ndarray:
        points = np.stack([other.at(now + time) for other in scene.others])
        half_sizes = np.stack([np.broadcast_to(other.half, points.shape[1:]) for other in scene.others])
        paths = PredictedPaths(points, np.arange(1, len(points) + 1), half_sizes, planner.dt)
        return planner.plan(state, paths, road).inputs[0]

    return drive


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stride", type=float, default=8.0, help="[m] between two distances")
    parser.add_argument("--out", type=Path, default=Path("emergency.json"))
    arguments = parser.parse_args()
    planner, result = MpcPlanner(), {}
    for kind in (blocked, cut_ins, squeezes, followers):
        scenes = list(kind(arguments.stride))
        drives = [(impact(planned(planner, scene), scene), impact(lambda *_: (-8.0, 0.0), scene)) for scene in scenes]
        own, braked = np.array(drives).T
        result[scenes[0].kind] = {
            "scenes": len(scenes),
            "worse than full braking by 0.5 m/s": int((own > braked + 0.5).sum()),
            "avoided by full braking but hit": int(((own > 0) & (braked == 0)).sum()),
            "worst excess [m/s]": float(max(0.0, (own - braked).max())),
            "hit by full braking but avoided": int(((own == 0) & (braked > 0)).sum()),
            "mean relative speed over that of full braking": float(own.mean() / braked.mean()),
        }
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
