"""What is called clear on a road that bends touches nothing in the map, and does not leave the road there."""

import numpy as np
import pytest
from bent_roads import bent_road, in_map, outline
from planning_scenes import CAR, CONSTANTS, DT, PROBLEM, SIZES, STEPS, driven, evaluated, fail_safe, sampled, wishes

import coverdrive.planning.problem.road_table as road_table
from coverdrive.geometry import boxes_overlap, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import SLOW, slow
from coverdrive.planning.surroundings import surroundings_of
from coverdrive.road import Road

TIMES = DT * np.arange(STEPS + 1)
SAMPLES = 12
"""of a step"""


def others(rng: np.random.Generator, state: np.ndarray, vehicles: int) -> tuple[PredictedPaths, np.ndarray, np.ndarray]:
    """Paths, and true states (S, T, 4) and half sizes (S, 2): anywhere in the boxes, and turned a little.

    Half of the vehicles drive right beside the ego.
    """
    along = np.where(rng.random(vehicles) < 0.3, 0.0, rng.uniform(-20, 35, vehicles))
    across = np.where(rng.random(vehicles) < 0.5, 0.0, rng.uniform(-2, 2, vehicles))
    meeting, near = rng.uniform(0, 3, vehicles), rng.choice([0.3, 1.0], vehicles)
    lon = state[0] + (state[2] - along) * meeting + near * rng.uniform(-25, 25, vehicles)
    lat = state[1] - across * meeting + near * rng.uniform(-7, 7, vehicles)
    sizes, heading = np.concatenate([SIZES, [[9.0, 1.3]]])[rng.integers(4, size=vehicles)], rng.normal(0, 0.1, vehicles)
    beside = rng.random(vehicles) < 0.5
    side = np.where(rng.random(vehicles) < 0.5, -1, 1) * (sizes[:, 1] + CAR.width / 2 + rng.uniform(0, 0.6, vehicles))
    along, across, heading = (np.where(beside, *each) for each in ((state[2], along), (0, across), (0, heading)))
    lon = np.where(beside, state[0] + rng.uniform(-8, 8, vehicles), lon)
    lat = np.where(beside, state[1] + side, lat)
    points = np.stack([lon[:, None] + along[:, None] * TIMES, lat[:, None] + across[:, None] * TIMES], axis=-1)
    points += (rng.normal(0, 0.1, points.shape) * ~beside[:, None, None]).cumsum(1)
    room = rng.choice([0.0, 0.1, 0.4]) * TIMES[:, None]
    half_sizes = turned_half_extents(sizes, heading)[:, None] + room
    share = rng.uniform(-1, 1, (vehicles, 1, 2))
    where = sampled(points, SAMPLES) + share * sampled(np.broadcast_to(room, points.shape[1:]), SAMPLES)
    turned = np.broadcast_to(heading[:, None, None], (*where.shape[:2], 1))
    true = np.concatenate([where, np.zeros_like(turned), turned], axis=-1)
    return PredictedPaths(points, np.arange(vehicles), half_sizes, DT), true, sizes


def beyond(states: np.ndarray, road: Road) -> np.ndarray:
    """By how much [m] the ego's body gets beyond the road's edges in the map, on each of some ways (…, T, 4)."""
    points = outline(*in_map(states, road), CAR.half_sizes, 3)
    lon, lat = road.to_road(points[..., 0], points[..., 1])
    edges = road.edges_at(lon)
    return np.maximum(lat - edges[..., -1], edges[..., 0] - lat).max((-1, -2), initial=-np.inf)


def clear_and_wrong(
    first: int, roads: int, scenes: int = 5, plans: int = 6, problem: ProblemSettings = PROBLEM, fastest: float = 30.0,
    turned: float = 0.04,
) -> np.ndarray:  # fmt: skip
    """Of plans in random scenes on random roads: how many are clear, of these how many touch, and how many leave."""
    found = np.zeros(3, int)
    for seed in range(first, first + roads):
        rng = np.random.default_rng(seed)
        road = bent_road(rng, rng.choice([1 / 150, 1 / 300, 1 / 1000]))
        if rng.random() < 0.5:  # wide: contacts are in the way, not the edges
            road = Road(np.array([-15.0, 3.6, 7.2, 25.0]), road.length, road.line)
        table = table_of(road, problem)
        constants = CONSTANTS._replace(vehicle=table.vehicle)
        for _ in range(scenes):
            lat = rng.uniform(1.2, 9.6)
            state = np.array([rng.uniform(150, 400), lat, rng.uniform(0, fastest), rng.normal(0, turned)])
            paths, true, sizes = others(rng, state, 2)
            around = surroundings_of(state, np.zeros(2), paths, table, problem)
            wished = wishes(rng, plans) * [1.0, rng.choice([0.05, 0.2, 1.0])]
            got = evaluated(wished, around, constants=constants)
            found += wrong(state, fail_safe(got)[got.clear], in_map(true, road), sizes, road)
    return found


def wrong(state: np.ndarray, inputs: np.ndarray, theirs: tuple, sizes: np.ndarray, road: Road) -> np.ndarray:
    """How many plans (m, K, 2) there are, how many touch somebody and how many leave the road."""
    touching, leaving = np.zeros(len(inputs), bool), np.zeros(len(inputs), bool)
    for parts, samples in ((1, SAMPLES), (SAMPLES, 1)) if len(inputs) else ():
        own = sampled(driven(state, inputs, parts)[1], samples)
        centre, heading = in_map(own, road)
        bodies = centre[:, None], heading[:, None], CAR.half_sizes
        touching |= boxes_overlap(*bodies, *theirs, sizes[:, None]).any((1, 2))
        leaving |= beyond(own[:, SAMPLES::3], road) > 0.01
    return np.array([len(inputs), touching.sum(), leaving.sum()])


def test_what_is_called_clear_touches_nothing_and_keeps_to_the_road() -> None:
    clear, touching, leaving = clear_and_wrong(0, 40)
    assert touching == leaving == 0
    assert 100 < clear < 1000


def test_what_is_called_clear_at_walking_pace_touches_nothing_and_keeps_to_the_road() -> None:
    slowly = PROBLEM.model_copy(update={"vehicle": slow(PROBLEM.vehicle)})
    clear, touching, leaving = clear_and_wrong(0, 60, problem=slowly, fastest=SLOW, turned=0.3)
    assert touching == leaving == 0
    assert clear > 50


@pytest.mark.slow
@pytest.mark.parametrize("part", range(2))
def test_what_is_called_clear_is_so_in_many_scenes(part: int) -> None:
    """10,000 scenes in all; 100,000 of them, ``range(20)``, take ten minutes."""
    clear, touching, leaving = clear_and_wrong(1000 + 1000 * part, 1000)
    assert touching == leaving == 0
    assert clear > 2_400


def _straight(half_sizes: np.ndarray, _: object, curvature: np.ndarray, *__: object) -> np.ndarray:
    """Bodies as on a straight road."""
    return half_sizes + np.zeros_like(curvature)[..., None]


def test_straight_bodies_and_wider_roads_would_not_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """The negative control: with bodies as on a straight road some touch, with edges 0.3 m further out some leave."""
    innermost = road_table.innermost_edges
    monkeypatch.setattr(road_table, "bent_half_sizes", _straight)
    monkeypatch.setattr(road_table, "innermost_edges", lambda *given: innermost(*given) - 0.3)
    _, touching, leaving = clear_and_wrong(0, 40)
    assert touching > 0
    assert leaving > 0
