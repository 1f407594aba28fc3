"""Random roads that bend and whose lanes change, and bodies on them in the map. T samples in time."""

import numpy as np

from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road

LENGTH = 600.0


def bent_road(rng: np.random.Generator, sharpest: float = 1 / 150, tapers: bool = True, length: float = LENGTH) -> Road:
    """A road of three lanes that bends to both sides by up to a curvature, evenly, changing or straight.

    On half of the roads an outer lane begins, and one ends.
    """
    count = int(length / 2) + 1
    kind = rng.integers(4)
    if kind == 0:
        curvature = np.full(count, rng.choice([-1, 1]) * sharpest)
    elif kind == 1:
        knots = np.arange(0, length + 60, 60.0)
        curvature = np.interp(2.0 * np.arange(count), knots, rng.uniform(-sharpest, sharpest, len(knots)))
    else:
        curvature = np.full(count, rng.uniform(-sharpest, sharpest) * (kind == 2))
    line = ReferenceLine(
        rng.uniform(-9, 9, 2), rng.uniform(-3, 3), curvature, length, lat=float(rng.choice([0.0, 5.4]))
    )
    edges, changing = np.arange(4) * 3.6, None
    if tapers and rng.random() < 0.5:
        places = np.sort(rng.uniform(150, 450, 4))
        places += np.arange(4)
        lats = np.tile(edges, (4, 1))
        lats[1:3, 0] = edges[1] if rng.random() < 0.5 else edges[0]
        lats[0, 3] = lats[3, 3] = edges[2] if rng.random() < 0.5 else edges[3]
        changing = LaneEdges(places, lats)
    return Road(edges, length, line, changing)


def in_map(states: np.ndarray, road: Road) -> tuple[np.ndarray, np.ndarray]:
    """Centres (…, 2) [m] and headings (…) [rad] in the map of states (…, 4) in the road frame."""
    lon, lat, _, heading = np.moveaxis(states, -1, 0)
    ahead = road.stretch(lon, lat) * np.cos(heading)
    centre = np.stack(road.to_map(lon, lat), axis=-1)
    return centre, road.heading_to_map(lon, np.arctan2(np.sin(heading), ahead))


def outline(centre: np.ndarray, heading: np.ndarray, half_sizes: np.ndarray, each: int = 9) -> np.ndarray:
    """Points (…, 4·each, 2) [m] around bodies in the map, corners among them."""
    side = np.linspace(-1, 1, each)
    one = np.ones(each)
    around = np.concatenate([np.stack(pair, -1) for pair in ((side, one), (side, -one), (one, side), (-one, side))])
    offset = around * half_sizes[..., None, :]
    cosine, sine = np.cos(heading)[..., None], np.sin(heading)[..., None]
    turned = np.stack(
        [offset[..., 0] * cosine - offset[..., 1] * sine, offset[..., 0] * sine + offset[..., 1] * cosine], -1
    )
    return centre[..., None, :] + turned
