"""A road of parallel lanes, in the road frame.

The road frame is right-handed: ``lon`` [m] runs along the road, ``lat`` [m] to the left, ``heading`` [rad] turns
counter-clockwise from the road's direction. Lanes are numbered from the right edge, starting at 0.

A road is straight and its lanes are even unless it has a reference line, beside which the frame bends, or lane edges
that change along it. Map coordinates are those of the reference line; on a straight road they are those of the road.

In scenes the frame is flat: speed and heading of a vehicle are those of the rates of lon and lat (`Road.rates`). With
these, lon' = speed · cos(heading) and lat' = speed · sin(heading) on any road, and who keeps both follows the road.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import jax
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.arguments import finite, shown, whole
from coverdrive.errors import DataError, SettingError
from coverdrive.reference_line import Numbers, ReferenceLine

NARROWEST = 2.0
"""[m] a lane that is narrower begins or ends there: nobody drives on it"""

LEAST_WIDTH = NARROWEST - 1e-3
"""[m] of a lane that is there: in single precision, its width may be a little less"""

AWAY = 1e3
"""[m] that a lane which is not there is farther away than any other"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class LaneEdges:
    """Lane edges of a road whose lanes change along it, linear between P positions; E edges."""

    lon: Float[np.ndarray, " P"]
    """[m] ascending; before the first and after the last position the edges stay as they are there"""
    lat: Float[np.ndarray, "P E"]
    """[m] edges from right to left, none to the right of the one before; a lane is there where its edges are at least
    `NARROWEST` apart"""

    def at(self, lon: Numbers) -> Float[np.ndarray, "*n E"]:
        """lat [m] of the edges at positions [m]."""
        return np.stack([np.interp(lon, self.lon, edge) for edge in self.lat.T], axis=-1)


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Road:
    """Lane edges and length of a road; L lanes have E = L + 1 edges."""

    edges: Float[Array | np.ndarray, " E"]
    """lat [m] of the lane edges, from the right edge of the road to the left, strictly ascending; the usual ones where
    they change along the road"""
    length: float | Float[Array, ""]
    """[m]"""
    line: ReferenceLine | None = None
    """where lon is measured; None: on a straight line"""
    changing: LaneEdges | None = None
    """edges along the road; None: they do not change"""
    speed_limit: float | None = None
    """[m/s]"""
    side: Literal["right", "left"] = field(default="right", metadata={"static": True})
    """of the road on which vehicles drive, and slower ones of a carriageway"""

    def __post_init__(self) -> None:
        """Refuse edges that cannot be calculated with; JAX puts other things than arrays into the fields, too."""
        if isinstance(self.edges, list | tuple):
            raise SettingError(
                f"the edges of a road: expected an array, as np.array({self.edges}); got the bare numbers"
            )

    def check(self) -> None:
        """Refuse, with a `DataError`, a road that nobody can drive on."""
        edges, length, limit = map(np.asarray, (self.edges, self.length, self.speed_limit or 1.0))
        if edges.dtype.kind not in "iuf" or not (
            edges.ndim == 1 and len(edges) > 1 and np.isfinite(edges).all() and (np.diff(edges) > 0).all()
        ):
            expected = "expected two or more, finite and ascending from the right edge of the road to the left"
            raise DataError(f"the road has lane edges at lat = {edges.tolist()} m; {expected}")
        if length.dtype.kind not in "iuf" or length.ndim or not float(length) > 0:
            raise DataError(f"the road is {shown(self.length)} m long; expected more than 0")
        if limit.dtype.kind not in "iuf" or limit.ndim:
            raise DataError(f"the speed limit is {shown(self.speed_limit)}; expected a number [m/s], or None")
        if self.side not in ("right", "left"):
            raise DataError(f"the road is driven on at the side {shown(self.side)}; expected 'right' or 'left'")

    def same(self, other: "Road") -> bool:
        """Whether they have the same line and lanes, so that what is at a position of one is there on the other."""
        if self is other:
            return True
        one, two = ((each.line, each.edges, each.changing) for each in (self, other))
        alike = self.side == other.side and jax.tree.structure(one) == jax.tree.structure(two)
        return alike and all(map(np.array_equal, jax.tree.leaves(one), jax.tree.leaves(two)))

    @property
    def lanes(self) -> int:
        """Number of lanes L."""
        return self.edges.shape[0] - 1

    @property
    def centres(self) -> Float[Array | np.ndarray, " L"]:
        """lat [m] of the lane centres."""
        return (self.edges[:-1] + self.edges[1:]) / 2

    def lane_of(self, lat: Any) -> Int[Any, "..."]:
        """Lane index of every lateral position, of any shape; positions off the road belong to the nearest lane."""
        return np.asarray(self.edges)[1:-1].searchsorted(lat, "right")

    def edges_at(self, lon: Numbers) -> Float[np.ndarray, "*n E"]:
        """lat [m] of the lane edges at positions [m]; they coincide where there is no lane between them."""
        if self.changing is None:
            return np.full((*np.shape(lon), self.edges.shape[0]), self.edges)
        return self.changing.at(lon)

    def has_lane(self, lon: Numbers) -> Bool[np.ndarray, "*n L"]:
        """Whether each lane is there at positions [m]."""
        if self.changing is None:
            return np.ones((*np.shape(lon), self.lanes), dtype=bool)
        return lanes_there(self.edges_at(lon))

    def lane_at(self, lon: Numbers, lat: Numbers) -> Int[np.ndarray, "*n"]:
        """Lane index at positions [m]: of the lanes that are there, the nearest; `lane_of` if all are."""
        if self.changing is None:
            return np.asarray(self.lane_of(lat))
        return np.asarray(nearest_lane(self.edges_at(lon), np.asarray(lat, dtype=float)))

    def curvature(self, lon: Numbers) -> Float[np.ndarray, "*n"]:
        """[1/m] of the reference line at positions [m], positive where it turns left."""
        return np.zeros(np.shape(lon)) if self.line is None else np.asarray(self.line.curvature_at(lon))

    def stretch(self, lon: Numbers, lat: Numbers) -> Float[np.ndarray, "*n"]:
        """[m] that one drives along the road for 1 m of lon, which is measured on the reference line."""
        if self.line is None:
            return np.ones(np.shape(lon))
        return np.asarray(1 - self.line.curvature_at(lon) * (np.asarray(lat) - self.line.lat))

    def to_road(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
        """Road frame (lon, lat) [m] of points [m] in map coordinates."""
        return (x, y) if self.line is None else self.line.to_road(x, y)

    def to_map(self, lon: Numbers, lat: Numbers) -> tuple[Numbers, Numbers]:
        """Map coordinates (x, y) [m] of points [m] in the road frame."""
        return (lon, lat) if self.line is None else self.line.to_map(lon, lat)

    def heading_to_road(self, lon: Numbers, heading: Numbers) -> Numbers:
        """Headings [rad] relative to the road, from −π to π, of ones in map coordinates."""
        return heading if self.line is None else _turned(heading - self.line.heading_at(lon))

    def heading_to_map(self, lon: Numbers, heading: Numbers) -> Numbers:
        """Headings [rad] in map coordinates, from −π to π, of ones relative to the road."""
        return heading if self.line is None else _turned(heading + self.line.heading_at(lon))

    def velocity_to_road(self, lon: Numbers, lat: Numbers, vx: Numbers, vy: Numbers) -> tuple[Numbers, Numbers]:
        """Rates (of lon, of lat) [m/s] of velocities [m/s] in map coordinates."""
        if self.line is None:
            return vx, vy
        cosine, sine = np.cos(self.line.heading_at(lon)), np.sin(self.line.heading_at(lon))
        return (vx * cosine + vy * sine) / self.stretch(lon, lat), vy * cosine - vx * sine

    def velocity_to_map(self, lon: Numbers, lat: Numbers, rate: Numbers, across: Numbers) -> tuple[Numbers, Numbers]:
        """Velocities (x, y) [m/s] in map coordinates of rates of lon and lat [m/s]."""
        if self.line is None:
            return rate, across
        cosine, sine = np.cos(self.line.heading_at(lon)), np.sin(self.line.heading_at(lon))
        along = rate * self.stretch(lon, lat)
        return along * cosine - across * sine, along * sine + across * cosine

    def rates(self, lon: Numbers, lat: Numbers, speed: Numbers, heading: Numbers) -> tuple[Numbers, Numbers]:
        """Speed [m/s] and heading [rad] in the road frame of who drives so fast with a heading relative to the road.

        They are those of the rates of lon and lat, as scenes have them.
        """
        if self.line is None:
            return speed, heading
        along, across = np.cos(heading) / self.stretch(lon, lat), np.sin(heading)
        return speed * np.hypot(along, across), np.arctan2(across, along)

    def bodies_to_map(self, lon: Numbers, lat: Numbers, heading: Numbers) -> tuple[Numbers, Numbers]:
        """Centres (…, 2) [m] and directions [rad] on the map of bodies with headings of the rates of lon and lat."""
        if self.line is None:
            return np.stack([lon, lat], axis=-1), heading
        x, y = self.velocity_to_map(lon, lat, np.cos(heading), np.sin(heading))
        return np.stack(self.to_map(lon, lat), axis=-1), np.arctan2(y, x)

    def mirrored(self) -> "Road":
        """The same road with left and right exchanged (lat → −lat)."""
        return replace(
            self,
            edges=-self.edges[::-1],
            line=None if self.line is None else self.line.mirrored(),
            changing=None if self.changing is None else LaneEdges(self.changing.lon, -self.changing.lat[:, ::-1]),
            side="left" if self.side == "right" else "right",
        )

    @staticmethod
    def straight(lanes: int = 3, width: float = 3.6, length: float = 1000.0) -> "Road":
        """A road of equal lanes whose right edge is at lat = 0; 3.6 m is the US freeway standard (AASHTO)."""
        lanes = whole("lanes", lanes, 1)
        if finite("width", width) <= 0 or finite("length", length) <= 0:
            raise SettingError(f"a road needs a positive width and length; got {width} m and {length} m")
        return Road(edges=np.arange(lanes + 1) * float(width), length=length)


def lanes_there(edges: Float[Any, "*n E"]) -> Bool[Any, "*n L"]:
    """Which lanes are there between their edges [m]."""
    return edges[..., 1:] - edges[..., :-1] > LEAST_WIDTH


def nearest_lane(edges: Float[Any, "*#n E"], lat: Float[Any, "*#n"]) -> Int[Any, "*n"]:
    """Lane index of positions [m] between edges [m]: of the lanes that are there, the nearest; of two the left one."""
    lat = lat[..., None]
    outside = (edges[..., :-1] - lat).clip(0) + (lat - edges[..., 1:]).clip(0) + AWAY * ~lanes_there(edges)
    return edges.shape[-1] - 2 - outside[..., ::-1].argmin(-1)


def _turned(angle: Numbers) -> Numbers:
    """The same angle [rad] between −π and π."""
    return np.remainder(angle + np.pi, 2 * np.pi) - np.pi
