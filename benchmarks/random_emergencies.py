"""Random emergencies with known futures, in hindsight: `python benchmarks/random_emergencies.py [--scenes 5000]`.

The ego is driven by the planner every 0.1 s for 6 s, against exactly what the others do. Bodies are rectangles in the
map, looked at every 10 ms; that of the ego turns, those of others point along the road. What counts is the relative
speed at the first contact with anybody (0: none); to leave the road by more than 5 cm is worse than any contact. The
planner is compared with the best, in hindsight, of 40 manoeuvres that are fixed from the start and driven within the
same limits (five decelerations to seven places across the road, and straight on), and with full braking in the lane.
What comes after the first contact counts in a second comparison: all drive on, and the hardest of the first contacts
with each of the others is what counts, since whoever touches lightly may run into somebody else at once. Roads have one
to four lanes and radii of 150 m or more; the ego meets debris, standing and braking vehicles, cut-ins, merging trucks,
late followers and cars beside it, several at once. It is an emergency if going on as before ends in a contact.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.geometry import boxes_overlap, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.check.evaluate import drive_step
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.road_table import RoadTable, table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import moved
from coverdrive.planning.solver.manoeuvres import lane_seeking
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from coverdrive.road_ahead import bend_at
from results import save

PERIOD, SMALL, LONGEST, FORESEEN = 0.1, 0.01, 6.0, 9.0
"""[s] between plans, between looks at contacts, of a drive, and for which the future is known"""
PARTS = round(PERIOD / SMALL)
"""looks in a period"""
PROBLEM = ProblemSettings()
EGO = PROBLEM.vehicle.half_sizes
CAR, MOTORCYCLE, TRUCK = np.array([[2.25, 0.9], [1.1, 0.4], [7.5, 1.27]])
LANE, LENGTH = 3.6, 800.0
START = 100.0
"""[m] lon of the ego, from where there is road behind it"""
DECELERATIONS = (8.0, 6.0, 4.0, 2.0, 0.0)
"""[m/s²] of the fixed manoeuvres"""
PLACES = 7
"""across the road, to which they steer"""
HURRY = 1.6
OFF = 0.05
"""[m] beyond the edge of the road that count for nothing"""
WORSE = 0.5
"""[m/s]"""


class Other(NamedTuple):
    """One of the others every 10 ms, T times."""

    centre: Float[np.ndarray, "T 2"]
    """lon [m], lat [m]; it points along the road, so that its predicted box is its body"""
    half: Float[np.ndarray, " 2"]
    """[m] half length and half width"""


class Scene(NamedTuple):
    """What a drive begins with."""

    seed: int
    road: Road
    state: Float[np.ndarray, " 4"]
    """lon [m], lat [m], speed [m/s], heading [rad]"""
    kinds: list[str]
    others: list[Other]


def other(
    lon: float, lat: float, speed: float, half: np.ndarray, *, braking: float = 0.0, after: float = 0.0,
    to: float | None = None, begin: float = 0.0, duration: float = 1.0,
) -> Other:  # fmt: skip
    """Keeps its speed, brakes to a stop from a time [s] on, and moves over smoothly from another time on."""
    time = SMALL * np.arange(round(FORESEEN / SMALL) + 1)
    lost = np.clip(time - after, 0.0, speed / braking) if braking else 0.0 * time
    ahead = speed * (np.minimum(time, after) if braking else time) + (speed - braking / 2 * lost) * lost
    over = np.clip((time - begin) / duration, 0.0, 1.0)
    lats = lat + ((lat if to is None else to) - lat) * over**2 * (3 - 2 * over)
    return Other(np.stack([lon + ahead, lats], axis=-1), np.asarray(half, float))


def threat(rng: np.random.Generator, kind: str, state: np.ndarray, lanes: int) -> Other:
    """One of the others, as random as its kind allows."""
    lon, lat, speed, _ = state
    own, sides = int(lat / LANE), [-1, 1]
    beside = [own + side for side in sides if 0 <= own + side < lanes]
    lane = rng.choice(beside) if beside else own
    there, jitter = LANE * (lane + 0.5), rng.uniform(-0.5, 0.5)
    far = rng.uniform(6.0, speed**2 / 16 + 20)
    if kind == "debris":
        half = rng.uniform(0.1, 0.6, 2)
        at = rng.uniform(max(0.3, lat - 3), min(lanes * LANE - 0.3, lat + 3)) if rng.random() < 0.5 else lat + jitter
        return other(lon + EGO[0] + far, at, 0.0, half)
    if kind == "standing":
        half = [CAR, MOTORCYCLE, TRUCK][rng.choice(3, p=[0.6, 0.2, 0.2])]
        where = LANE * (rng.choice([own, lane]) + 0.5) + jitter
        return other(lon + EGO[0] + half[0] + far, where, rng.choice([0.0, 0.3]) * speed, half)
    if kind == "leader":
        gap = rng.uniform(4.0, 4.0 + 1.2 * speed)
        half = [CAR, MOTORCYCLE, TRUCK][rng.choice(3, p=[0.7, 0.1, 0.2])]
        begin = lon + EGO[0] + half[0] + gap
        where = LANE * (own + 0.5) + jitter
        return other(
            begin, where, speed * rng.uniform(0.6, 1.1), half, braking=rng.uniform(4, 9), after=rng.uniform(0, 1)
        )
    if kind == "cut-in":
        return other(
            lon + rng.uniform(-3, 25), there, speed * rng.uniform(0.5, 1.0), CAR, braking=rng.uniform(1, 8),
            after=rng.uniform(0.5, 2.5), to=lat + jitter, begin=rng.uniform(0, 1.5), duration=rng.uniform(1.0, 2.5),
        )  # fmt: skip
    if kind == "merging truck":
        half = np.array([rng.uniform(5, 9), 1.27])
        return other(
            lon + rng.uniform(-8, 30), there, speed * rng.uniform(0.5, 1.05), half,
            to=LANE * (own + 0.5), begin=rng.uniform(0, 1.5), duration=rng.uniform(2.0, 4.0),
        )  # fmt: skip
    if kind == "follower":
        begin = lon - EGO[0] - CAR[0] - rng.uniform(3.0, 25.0)
        return other(begin, lat + jitter, speed * rng.uniform(0.9, 1.25), CAR, braking=6.0, after=rng.uniform(0.5, 1.5))
    half = [CAR, TRUCK][rng.choice(2, p=[0.8, 0.2])]
    return other(lon + rng.uniform(-10, 10), there, speed * rng.uniform(0.85, 1.1), half)  # beside


THREATS = ("debris", "standing", "leader", "cut-in", "merging truck")
KINDS = (*THREATS, "follower", "beside")


def scene_of(seed: int) -> Scene:
    """A random scene; not all are emergencies."""
    rng = np.random.default_rng(seed)
    lanes, speed, line = int(rng.choice([1, 2, 3, 4], p=[0.1, 0.3, 0.4, 0.2])), rng.uniform(10, 42), None
    if rng.random() < 0.4:
        curvature = rng.choice([-1, 1]) / rng.uniform(150, 1000)
        speed = min(speed, np.sqrt(3.0 / abs(curvature)))
        line = ReferenceLine(np.zeros(2), 0.0, np.full(int(LENGTH / 2) + 1, curvature), LENGTH, lat=LANE * lanes / 2)
    road = Road(LANE * np.arange(lanes + 1), LENGTH, line)
    lat = LANE * (rng.integers(lanes) + 0.5) + rng.uniform(-0.4, 0.4)
    state = np.array([START, lat, speed, rng.uniform(-0.02, 0.02)])
    kinds, others = list[str](), list[Other]()
    for place in range(rng.integers(1, 5)):
        kind = str(rng.choice(THREATS if place == 0 else KINDS))
        if lanes == 1 and kind in ("cut-in", "merging truck", "beside"):
            kind = "debris"
        one = threat(rng, kind, state, lanes)
        apart = [np.abs(state[:2] - one.centre[0]) - EGO - one.half]
        apart += [np.abs(each.centre[0] - one.centre[0]) - each.half - one.half for each in others]
        if all(gap[0] > 1.0 or gap[1] > 0.3 for gap in apart):
            kinds.append(kind)
            others.append(one)
    return Scene(seed, road, state, kinds, others)


def severities(states: Float[np.ndarray, "m T 4"], scene: Scene) -> Float[np.ndarray, "m 2"]:
    """[m/s] relative speed at the first contact of motions, every 10 ms from the start, and at the hardest of the first
    ones with each of the others; infinity off the road before the first.
    """
    size = states.shape[1]
    lon, lat, _, heading = np.moveaxis(states, -1, 0)
    centre, heading = scene.road.bodies_to_map(lon, lat, heading)
    velocity = np.gradient(centre, SMALL, axis=1)
    first, result = np.full(len(states), size), np.zeros((len(states), 2))
    for each in scene.others:
        there, turned = scene.road.bodies_to_map(*each.centre[:size].T, np.zeros(size))
        near = np.hypot(*np.moveaxis(centre - there, -1, 0)) < np.hypot(*EGO) + np.hypot(*each.half)
        if not near.any():
            continue
        _, time = np.nonzero(near)
        hit = np.zeros(near.shape, bool)
        hit[near] = boxes_overlap(centre[near], heading[near], EGO, there[time], turned[time], each.half)
        when = np.where(hit.any(axis=1), hit.argmax(axis=1), size)
        relative = velocity - np.gradient(there, SMALL, axis=0)
        for i in np.flatnonzero(when < size):
            speed = np.linalg.norm(relative[i, when[i]])
            if when[i] < first[i]:
                first[i], result[i, 0] = when[i], speed
            result[i, 1] = max(result[i, 1], speed)
    result[off_road(states, scene.road, first)] = np.inf
    return result


def off_road(states: Float[np.ndarray, "m T 4"], road: Road, until: np.ndarray) -> Bool[np.ndarray, " m"]:
    """Which motions get beyond the edges before a time."""
    half = turned_half_extents(EGO, states[..., 3])[..., 1]
    beyond = np.maximum(states[..., 1] + half - road.edges[-1], road.edges[0] - states[..., 1] + half)
    return ((beyond > OFF) & (np.arange(states.shape[1]) < until[:, None])).any(axis=1)


def followed(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """The states (…, 10, 4) in the period after this one, every 10 ms."""
    motion = np.empty((*state.shape[:-1], PARTS + 1, 4))
    motion[..., 0, :], motion[..., 1:, 2:] = state, SMALL * inputs[..., None, :]
    motion[..., 2:] = np.add.accumulate(motion[..., 2:], axis=-2)
    motion[..., 2] = np.maximum(motion[..., 2], 0.0)
    before, held = (0.0, 0.0, motion[..., :-1, 2], motion[..., :-1, 3]), (inputs[..., None, 0], inputs[..., None, 1])
    motion[..., 1:, 0], motion[..., 1:, 1], *_ = moved(before, held, SMALL)
    motion[..., :2] = np.add.accumulate(motion[..., :2], axis=-2)
    return motion[..., 1:, :]


def manoeuvres(scene: Scene, wishes: list[tuple[float, float]], table: RoadTable) -> Float[np.ndarray, "m T 4"]:
    """Motions that steer to a place [m] at an acceleration [m/s²], for each of the wishes."""
    states, before = np.tile(scene.state, (len(wishes), 1)), [(0.0, 0.0)] * len(wishes)
    motions, road = [states[:, None]], table.ahead(float(scene.state[0]))
    for _ in range(round(LONGEST / PERIOD)):
        for i, (acceleration, place) in enumerate(wishes):
            lon, lat, speed, heading = states[i].tolist()
            state = lon - START, lat, speed, heading
            wish = acceleration, lane_seeking(lat, speed, heading, place, HURRY)
            bend = bend_at(state, PERIOD, road)
            before[i], _ = drive_step(state, wish, before[i], PERIOD, PERIOD, bend, table.vehicle)
        motions.append(followed(states, np.array(before)))
        states = motions[-1][:, -1]
    return np.concatenate(motions, axis=1)


def fixed(scene: Scene) -> list[tuple[float, float]]:
    """Acceleration [m/s²] and place across the road [m] of the 40 manoeuvres."""
    room = EGO[1] + 0.1
    places = [*np.linspace(scene.road.edges[0] + room, scene.road.edges[-1] - room, PLACES), scene.state[1]]
    return [(-deceleration, float(place)) for deceleration in DECELERATIONS for place in places]


class Yardsticks(NamedTuple):
    """[m/s] at the first and at the hardest contact (`severities`)."""

    going_on: Float[np.ndarray, " 2"]
    """as before"""
    braking: Float[np.ndarray, " 2"]
    """fully, in the lane"""
    best: Float[np.ndarray, " 2"]
    """of the 40, by each"""


def yardsticks(scene: Scene) -> Yardsticks:
    """What the others are worth; full braking and the best of the 40 are 0 where going on hits nobody."""
    lane, table, nothing = float(scene.state[1]), table_of(scene.road, PROBLEM), np.zeros(2)
    going_on = severities(manoeuvres(scene, [(0.0, lane)], table), scene)[0]
    if going_on[0] == 0:
        return Yardsticks(going_on, nothing, nothing)
    got = severities(manoeuvres(scene, [(-PROBLEM.vehicle.max_deceleration, lane), *fixed(scene)], table), scene)
    return Yardsticks(going_on, got[0], got[1:].min(axis=0))


def planned(planner: MpcPlanner, scene: Scene) -> Float[np.ndarray, " 2"]:
    """[m/s] of the planner's drive, by `severities`."""
    planner.reset(PERIOD)
    steps, every = planner.steps, round(planner.dt / SMALL)
    half_sizes = np.stack([np.broadcast_to(each.half, (steps + 1, 2)) for each in scene.others])
    motion = [scene.state[None]]
    for now in range(round(LONGEST / PERIOD)):
        at = slice(now * PARTS, now * PARTS + steps * every + 1, every)
        points = np.stack([each.centre[at] for each in scene.others])
        paths = PredictedPaths(points, np.arange(1, len(points) + 1), half_sizes, planner.dt)
        plan = planner.plan(motion[-1][-1], paths, scene.road)
        motion.append(followed(motion[-1][-1], plan.inputs[0]))
    return severities(np.concatenate(motion)[None], scene)[0]


def emergencies(first: int) -> Iterator[tuple[Scene, Yardsticks]]:
    """Scenes from a seed on in which going on hits, with what the others do."""
    while True:
        scene = scene_of(first)
        if scene.others:
            others = yardsticks(scene)
            if 0 < others.going_on[0] < np.inf:
                yield scene, others
        first += 1


def row_of(planner: MpcPlanner, scene: Scene, others: Yardsticks) -> dict[str, list[float]]:
    """[m/s] at the first and at the hardest contact."""
    each = {"planner": planned(planner, scene), "braking": others.braking, "best of 40": others.best}
    return {name: got.tolist() for name, got in each.items()}


def compared(rows: list[dict]) -> dict:
    """The numbers of all scenes."""
    ours, braking, best = (np.array([row[key] for row in rows]) for key in ("planner", "braking", "best of 40"))
    either = np.minimum(braking, best)
    return {
        "scenes": len(rows),
        "hit though one of 40 avoids": int(((ours > 0) & (best == 0))[:, 0].sum()),
        "avoided though all 40 hit": int(((ours == 0) & (either > 0))[:, 0].sum()),
        "off the road": int(np.isinf(ours[:, 0]).sum()),
        **{
            f"by the {contact} contact": {
                "worse than full braking": int((ours > braking + WORSE)[:, i].sum()),
                "worse than the best of 40": int((ours > best + WORSE)[:, i].sum()),
                "mean [m/s]": {
                    name: float(each[np.isfinite(each[:, i]), i].mean())
                    for name, each in (("planner", ours), ("full braking", braking), ("best of 40", best))
                },
            }
            for i, contact in enumerate(("first", "hardest"))
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=5000, help="number of emergencies")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--out", type=Path, default=Path("random_emergencies.json"))
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    arguments = parser.parse_args()
    planner, rows, found = MpcPlanner(), list[dict](), emergencies(arguments.seed)
    for scene, others in (next(found) for _ in range(arguments.scenes)):
        row = row_of(planner, scene, others)
        rows.append({"seed": scene.seed, "kinds": scene.kinds, **row})
        (ours, hardest), (braking, _), (best, least) = row.values()
        if ours > min(braking, best) + WORSE or (ours > 0 and best == 0):
            print(
                f"seed {scene.seed}: {ours:.1f} m/s, braking {braking:.1f}, best of 40 {best:.1f}; by the hardest "
                f"contact {hardest:.1f}, best of 40 {least:.1f}; {scene.kinds}"
            )
    result = compared(rows)
    print(json.dumps(result, indent=2))
    arguments.out.write_text(
        json.dumps({**result, "first seed": arguments.seed, "drives": rows}, indent=1) + "\n", encoding="utf-8"
    )
    if arguments.save:
        save(arguments.save, result, arguments.seed)


if __name__ == "__main__":
    main()
