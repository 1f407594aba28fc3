"""Lanes of a Lanelet2 map (Poggenhans et al. 2018), an OSM file of nodes, ways, and relations of the type ``lanelet``.

Nodes are at geographic coordinates; their UTM coordinates (zone of the first one) count from the origin of the tracks.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from coverdrive.errors import RecordingError

Numbers = Any
"""NumPy arrays of any shape, and numbers"""

Origin = Callable[[int], tuple[float, float]]
"""UTM coordinates [m] of a map's origin in a zone"""

FOR_CARS = ("", "road", "highway")
"""Subtypes of lanelets that vehicles drive on"""

MAJOR, FLATTENING, SCALE = 6_378_137.0, 1 / 298.257223563, 0.9996
"""[m] and flattening of WGS 84; UTM's scale on the central meridian"""


class Lanelet(NamedTuple):
    """A piece of a lane, as `coverdrive.recordings.roads.lanelets.carriageways` takes it."""

    lanelet_id: int
    left_vertices: Float[np.ndarray, "P 2"]
    right_vertices: Float[np.ndarray, "Q 2"]
    distance: Float[np.ndarray, " 2"]
    predecessor: list[int]
    successor: list[int]
    adj_left: int | None
    adj_left_same_direction: bool
    adj_right: int | None
    adj_right_same_direction: bool


class _Bounds(NamedTuple):
    """Bounds of a lanelet in its direction: the numbers of their ways, and those of their nodes."""

    ways: tuple[int, int]
    left: list[int]
    right: list[int]


def read_lanelet2(file: Path, origin: Origin) -> list[Lanelet]:
    """The lanelets of a map, in metres from its origin.

    Raises:
        RecordingError: the file is no such map.
    """
    try:
        root = ElementTree.fromstring(file.read_bytes())
        if root.tag == "OpenDRIVE":
            raise RecordingError(
                file, "an OpenDRIVE map, which is not read; name the Lanelet2 map (.osm) beside it, or none"
            )
        places = _places(root, origin)
        ways = {int(way.attrib["id"]): [int(nd.attrib["ref"]) for nd in way.iter("nd")] for way in root.iter("way")}
        bounds = {
            int(each.attrib["id"]): _bounds(each, ways, places) for each in root.iter("relation") if _for_cars(each)
        }
    except (ElementTree.ParseError, KeyError, ValueError, IndexError) as error:
        problem = f"not a Lanelet2 map, or damaged ({type(error).__name__}: {error}); expected an OSM file of lanelets"
        raise RecordingError(file, problem) from error
    if not bounds:
        raise RecordingError(file, "the map has no lanelets that vehicles drive on; choose another file")
    starts = {(own.left[0], own.right[0]): number for number, own in bounds.items()}
    ends = {(own.left[-1], own.right[-1]): number for number, own in bounds.items()}
    beside_left = {own.ways[1]: number for number, own in bounds.items()}
    beside_right = {own.ways[0]: number for number, own in bounds.items()}
    found: list[Lanelet] = []
    for number, own in bounds.items():
        left, right = (np.array([places[node] for node in nodes]) for nodes in (own.left, own.right))
        length = float(np.sum(np.hypot(*np.diff(left, axis=0).T)) + np.sum(np.hypot(*np.diff(right, axis=0).T))) / 2
        after, before = starts.get((own.left[-1], own.right[-1])), ends.get((own.left[0], own.right[0]))
        on_left, on_right = beside_left.get(own.ways[0]), beside_right.get(own.ways[1])
        found.append(
            Lanelet(
                number,
                left,
                right,
                np.array([0.0, length]),
                [] if before is None else [before],
                [] if after is None else [after],
                on_left,
                on_left is not None and bounds[on_left].right[0] == own.left[0],
                on_right,
                on_right is not None and bounds[on_right].left[0] == own.right[0],
            )
        )
    return found


def _for_cars(relation: ElementTree.Element) -> bool:
    tags = {tag.attrib["k"]: tag.attrib["v"] for tag in relation.iter("tag")}
    return tags.get("type") == "lanelet" and tags.get("subtype", "") in FOR_CARS


def _bounds(relation: ElementTree.Element, ways: dict[int, list[int]], places: dict[int, np.ndarray]) -> _Bounds:
    """Its bounds, turned so that both run one way and the left one is on the left."""
    refs = {each.attrib["role"]: int(each.attrib["ref"]) for each in relation.iter("member")}
    left, right = ways[refs["left"]], ways[refs["right"]]

    def apart(one: int, other: int) -> float:
        return float(np.hypot(*(places[one] - places[other])))

    if apart(left[0], right[0]) + apart(left[-1], right[-1]) > apart(left[0], right[-1]) + apart(left[-1], right[0]):
        right = right[::-1]
    on_left, on_right = (np.array([places[node] for node in nodes]) for nodes in (left, right))
    ahead = on_left[-1] - on_left[0] + on_right[-1] - on_right[0]
    aside = on_left[0] + on_left[-1] - on_right[0] - on_right[-1]
    if ahead[0] * aside[1] - ahead[1] * aside[0] < 0:
        left, right = left[::-1], right[::-1]
    return _Bounds((refs["left"], refs["right"]), left, right)


def _places(root: ElementTree.Element, origin: Origin) -> dict[int, np.ndarray]:
    """Positions [m] of all nodes."""
    nodes = list(root.iter("node"))
    latitude, longitude = (np.array([float(node.attrib[name]) for node in nodes]) for name in ("lat", "lon"))
    if not (np.all(np.abs(latitude) < 85) and np.all(np.abs(longitude) <= 180)):
        raise ValueError("a node has no geographic coordinates")
    zone = int((longitude[0] + 180) // 6) + 1
    east, north = utm(latitude, longitude, zone)
    x, y = origin(zone)
    places = np.stack([east - x, north - y], axis=-1)
    return {int(node.attrib["id"]): place for node, place in zip(nodes, places, strict=True)}


def utm(latitude: Numbers, longitude: Numbers, zone: int) -> tuple[Numbers, Numbers]:
    """UTM coordinates (east, north) [m] of places [degrees] on WGS 84, by Krüger's series to the third order: 1 mm."""
    n = FLATTENING / (2 - FLATTENING)
    radius = MAJOR / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
    series = (n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16, 13 * n**2 / 48 - 3 * n**3 / 5, 61 * n**3 / 240)
    phi, lam = np.radians(latitude), np.radians(np.asarray(longitude) - (6 * zone - 183))
    excentric = 2 * np.sqrt(n) / (1 + n)
    conformal = np.sinh(np.arctanh(np.sin(phi)) - excentric * np.arctanh(excentric * np.sin(phi)))
    north, east = np.arctan2(conformal, np.cos(lam)), np.arctanh(np.sin(lam) / np.hypot(1, conformal))
    waves = [(2 * order, factor) for order, factor in enumerate(series, start=1)]
    easting = east + sum(factor * np.cos(k * north) * np.sinh(k * east) for k, factor in waves)
    northing = north + sum(factor * np.sin(k * north) * np.cosh(k * east) for k, factor in waves)
    return 500_000 + SCALE * radius * easting, SCALE * radius * northing
