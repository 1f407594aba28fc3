"""One moment of a drive as seen from above, in the coordinates of the own car: what snapshots and animation share.

Vehicles are turned boxes with their speed in them. The predicted sets are the union of all boxes of all paths, the
paler the later; the own plan is a line with the outline of the body at every full second.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.text import Text

from coverdrive.paths import PredictedPaths
from coverdrive.planning.plan import Plan
from coverdrive.report import style
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.initial import OWN
from coverdrive.simulation.motion import half_sizes_of, states_of

VERGE = 0.8
"""[m] shown beyond the edges of the road"""

_DASH, _DASH_PERIOD = 3.0, 12.0
"""[m] length of a lane marking, and from one to the next (MUTCD: 10 ft of 40 ft)"""

_CORNERS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


@dataclass(frozen=True)
class Window:
    """The stretch of road that is shown."""

    behind: float = 35.0
    """[m] behind the own car's centre"""
    ahead: float = 105.0
    """[m] ahead of it"""


@dataclass(frozen=True)
class RoadDrawing:
    """The artists of one picture; `show` moves them to another moment."""

    road: Road
    window: Window
    dashes: LineCollection
    sets: PolyCollection
    plan: Line2D
    planned_bodies: PolyCollection
    vehicles: PolyCollection
    speeds: tuple[Text, ...] = field(repr=False)
    """one per vehicle slot"""

    @staticmethod
    def on(axes: Axes, road: Road, slots: int, window: Window | None = None) -> "RoadDrawing":
        """Prepare a drawing.

        Args:
            axes: to draw into; its limits are set.
            road: its lanes; the road is drawn without end.
            slots: number of vehicle slots A, the own car's included.
            window: the stretch shown.
        """
        window = window or Window()
        edges = np.asarray(road.edges)
        axes.set(xlim=(-window.behind, window.ahead), ylim=(edges[0] - VERGE, edges[-1] + VERGE), aspect="equal")
        axes.set(yticks=np.asarray(road.centres), yticklabels=[f"lane {lane + 1}" for lane in range(road.lanes)])
        axes.tick_params(axis="y", length=0)
        axes.spines[["left", "bottom"]].set_visible(False)
        axes.axhspan(edges[0], edges[-1], facecolor=style.ROAD, zorder=0)
        for edge in edges[[0, -1]]:
            axes.axhline(edge, color=style.MARKING, linewidth=1.5, zorder=3)
        return RoadDrawing(
            road=road,
            window=window,
            sets=axes.add_collection(PolyCollection([], linewidths=0, rasterized=True, zorder=1), autolim=False),
            dashes=axes.add_collection(
                LineCollection([], colors=style.MARKING, linewidths=1.2, capstyle="butt", zorder=2), autolim=False
            ),
            planned_bodies=axes.add_collection(
                PolyCollection([], facecolors="none", edgecolors=style.OWN, linewidths=1.0, zorder=4), autolim=False
            ),
            plan=axes.plot([], [], color=style.OWN, marker="o", markersize=2.5, linewidth=1.4, zorder=5)[0],
            vehicles=axes.add_collection(
                PolyCollection([], edgecolors="white", linewidths=0.8, zorder=6), autolim=False
            ),
            speeds=tuple(
                axes.text(
                    0, 0, "", color="white", fontsize=8, ha="center", va="center_baseline", clip_on=True, zorder=7
                )
                for _ in range(slots)
            ),
        )

    @property
    def artists(self) -> tuple[Artist, ...]:
        """All that `show` changes, from back to front."""
        return (self.sets, self.dashes, self.planned_bodies, self.plan, self.vehicles, *self.speeds)

    def show(self, scene: Scene, paths: PredictedPaths | None = None, plan: Plan | None = None) -> None:
        """Show a moment.

        Args:
            scene: an unbatched scene with the own car in slot 0.
            paths: what was predicted at this moment.
            plan: what the own car planned at this moment.
        """
        origin = np.array([float(scene.lon[OWN]), 0.0])
        self._show_sets(paths, origin)
        self._show_plan(plan, origin, half_sizes_of(scene)[OWN])
        self._show_vehicles(scene, origin)
        self.dashes.set_segments(self._dashes(origin[0]))

    def _show_sets(self, paths: PredictedPaths | None, origin: Float[np.ndarray, " 2"]) -> None:
        if paths is None:
            self.sets.set_verts([])
            return
        boxes, age = set_boxes(paths)
        boxes = boxes - origin
        seen = (boxes[..., 0].max(-1) > -self.window.behind) & (boxes[..., 0].min(-1) < self.window.ahead)
        self.sets.set_verts(boxes[seen])  # pyright: ignore[reportArgumentType]
        self.sets.set_facecolor(style.SETS(age[seen]))

    def _show_plan(
        self, plan: Plan | None, origin: Float[np.ndarray, " 2"], half_sizes: Float[np.ndarray, " 2"]
    ) -> None:
        states = np.zeros((0, 4)) if plan is None else plan.states
        self.plan.set_data(*(states[:, :2] - origin).T)
        times = np.zeros(0) if plan is None else plan.dt * np.arange(len(states))
        full = np.isclose(times, np.round(times)) & (times > 0.5)
        self.planned_bodies.set_verts(body_corners(states[full], half_sizes) - origin)  # pyright: ignore[reportArgumentType]

    def _show_vehicles(self, scene: Scene, origin: Float[np.ndarray, " 2"]) -> None:
        corners = body_corners(states_of(scene), half_sizes_of(scene)) - origin
        valid = np.asarray(scene.valid)
        colours = [to_rgba(style.OWN if slot == OWN else style.OTHER) for slot in np.flatnonzero(valid)]
        self.vehicles.set_verts(corners[valid])  # pyright: ignore[reportArgumentType]
        self.vehicles.set_facecolor(colours)
        for slot, text in enumerate(self.speeds):
            text.set_position(tuple(corners[slot].mean(0)))
            text.set_text(f"{scene.speed[slot]:.0f}" if valid[slot] else "")

    def _dashes(self, own_lon: float) -> Float[np.ndarray, "n 2 2"]:
        """Lane markings, which stand still on the road."""
        first = -own_lon % _DASH_PERIOD - _DASH_PERIOD
        start = np.arange(-np.ceil(self.window.behind / _DASH_PERIOD), self.window.ahead / _DASH_PERIOD + 1)
        start = first + _DASH_PERIOD * start
        inner = np.asarray(self.road.edges)[1:-1]
        lon = np.stack([start, start + _DASH], axis=-1)
        lon, lat = np.broadcast_arrays(lon, inner[:, None, None])
        return np.stack([lon, lat], axis=-1).reshape(-1, 2, 2)


def set_boxes(paths: PredictedPaths) -> tuple[Float[np.ndarray, "n 4 2"], Float[np.ndarray, " n"]]:
    """Corners [m] of all boxes of all paths, the latest first, and the share of the horizon at which each is.

    Boxes are added halfway between two points, so that fast vehicles leave no gaps: 2K + 1 boxes for each path.
    """
    points, half_sizes = _with_midpoints(paths.points), _with_midpoints(paths.half_sizes)
    count = points.shape[1]
    boxes = points[:, :, None] + _CORNERS * half_sizes[:, :, None]
    age = np.broadcast_to(np.linspace(0, 1, count), boxes.shape[:2])
    latest_first = np.s_[:, ::-1]
    return (
        boxes[latest_first].swapaxes(0, 1).reshape(-1, 4, 2),
        age[latest_first].swapaxes(0, 1).reshape(-1),
    )


def body_corners(
    states: Float[np.ndarray, "*n 4"], half_sizes: Float[np.ndarray, "*#n 2"]
) -> Float[np.ndarray, "*n 4 2"]:
    """Corners [m] of bodies turned by their heading.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        half_sizes: half length and half width [m].
    """
    along, across = np.moveaxis(half_sizes[..., None, :] * _CORNERS, -1, 0)
    cosine, sine = np.cos(states[..., 3, None]), np.sin(states[..., 3, None])
    turned = np.stack([along * cosine - across * sine, along * sine + across * cosine], axis=-1)
    return states[..., None, :2] + turned


def _with_midpoints(values: Float[np.ndarray, "S K+1 2"]) -> Float[np.ndarray, "S 2K+1 2"]:
    """The values at twice the rate, by linear interpolation."""
    result = np.repeat(values, 2, axis=1)[:, :-1]
    result[:, 1::2] = (values[:, :-1] + values[:, 1:]) / 2
    return result
