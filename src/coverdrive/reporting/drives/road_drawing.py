"""One moment of a drive as seen from above, in the coordinates of the ego: what snapshots and animation share.

Predicted sets have the hue of their time; what is active, and the ego on its fail-safe branch at every full second, the
dark hue of the same time. `coverdrive.reporting.drives.snapshots.add_legend` explains all of it.
"""

from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.path import Path

from coverdrive.geometry import CORNERS, body_corners
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.reporting.drives.active_constraints import active_constraints
from coverdrive.reporting.drives.reasons import Reason, reason_of
from coverdrive.reporting.plotting import style
from coverdrive.road import Road
from coverdrive.road_markings import across, dashes, markings
from coverdrive.scene import Scene
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.roads.initial import EGO

BEHIND, AHEAD = 35.0, 105.0
"""[m] of road that is shown behind and ahead of the ego's centre"""

VERGE = 0.8
"""[m] shown beyond the edges of the road"""

_CLEAR = 10
"""outlines of active boxes that are drawn in full colour; more of them are paler"""

_NUMBER = 1.5
"""[m] on either side of its centre that the number in a vehicle may take; where that is cut off, it has none"""

_FRAME = 0.45
"""[m] width of the frame of a vehicle that has left its predicted set"""


def height_of(road: Road, width: float) -> float:
    """Height of a drawing of this width, in the same unit."""
    return width * (float(np.ptp(across(road))) + 2 * VERGE) / (BEHIND + AHEAD)


class RoadDrawing:
    """The artists of one picture; `show_moment` moves them to another moment."""

    def __init__(self, axes: Axes, road: Road, slots: int):
        """Prepare a drawing on axes, whose limits are set, with a text for every vehicle slot, the ego's included."""
        self._road = road
        (right, left), limits = across(road), (-BEHIND, AHEAD)
        axes.set(xlim=limits, ylim=(right - VERGE, left + VERGE), aspect="equal")
        axes.set(yticks=np.asarray(road.centres), yticklabels=[f"lane {lane}" for lane in range(road.lanes)])
        axes.tick_params(axis="y", length=0)
        axes.spines[["left", "bottom"]].set_visible(False)
        self.surface = PolyCollection([], facecolor=style.ROAD, linewidths=0, zorder=0)
        # where the other vehicles may be: one union of boxes for every moment, and a line for every predicted path
        self.sets = PathCollection([], linewidths=0, rasterized=True, zorder=1)
        self.dashes = LineCollection([], colors=style.MARKING, linewidths=0.8, capstyle="butt", zorder=2)
        self.members = LineCollection([], colors=style.OTHER, linewidths=0.4, zorder=2)
        self.borders = LineCollection([], colors=style.MARKING, linewidths=1.0, zorder=3)
        # boxes of predicted paths that are active constraints of the plan, and the ego at every full second of it
        self.active = PolyCollection([], facecolors="none", linewidths=0.8, zorder=3.5)
        self.bodies = PolyCollection([], facecolors="none", linewidths=0.9, zorder=4)
        # the first contact of a plan that is not clear: the box, and the ego
        face = to_rgba(style.BAD, 0.25)
        self.met = PolyCollection(
            [], facecolors=face, edgecolors=style.BAD, linewidths=1.2, linestyles="--", zorder=4.5
        )
        self.plan = axes.plot([], [], color=style.EGO, marker="o", markersize=1.5, linewidth=1.0, zorder=5)[0]
        self.fail_safe = axes.plot([], [], color=style.EGO, linestyle="--", linewidth=1.0, zorder=5)[0]
        # frames of vehicles that have left their predicted sets
        self.frames = PolyCollection([], facecolors=style.BLACK, linewidths=0, zorder=5.5)
        self.vehicles = PolyCollection([], edgecolors="white", linewidths=0.5, zorder=6)
        text: dict[str, Any] = {"color": "white", "fontsize": 5.5, "ha": "center", "va": "center_baseline"}
        self.speeds = [axes.text(0, 0, "", clip_on=True, zorder=7, **text) for _ in range(slots)]
        self.artists: tuple[Artist, ...] = (
            self.surface, self.sets, self.dashes, self.members, self.borders, self.active, self.bodies, self.met,
            self.plan, self.fail_safe, self.frames, self.vehicles, *self.speeds,
        )  # fmt: skip
        """all that changes, or lies on top of what changes, from back to front"""
        for artist in self.artists:
            if isinstance(artist, Collection):
                axes.add_collection(artist, autolim=False)

    def show_moment(
        self,
        trace: Trace,
        moment: int,
        problem: ProblemSettings | None = None,
        left: Bool[np.ndarray, "m A"] | None = None,
    ) -> Scene:
        """Show moment 0 … n of a trace of n steps, and return its scene; at moment n, what was planned the step before.

        Active constraints of the planner's ``problem`` are marked, if it is known, and vehicles that left their sets if
        ``left``, which is `coverdrive.simulation.measures.misses.left_recently` of the trace, tells them.
        """
        scene: Scene = jax.tree.map(lambda values: values[moment], trace.scene)
        origin = np.array([float(scene.lon[EGO]), 0.0])
        planned = min(moment, len(trace) - 1)
        paths = trace.paths[planned]
        self.show(scene, paths, trace.plans[planned])
        boxes, times = np.zeros((0, 4, 2)), np.zeros(0)
        if problem is not None:
            active = active_constraints(trace, planned, problem)
            boxes, times = _path_boxes(paths)[active], active.nonzero()[1] / (active.shape[1] - 1)
        self.active.set_edgecolor(style.TIMES(times).tolist())
        self.active.set_alpha(float(np.clip(_CLEAR / max(len(boxes), 1), 0.15, 1)))
        self.active.set_verts(list(boxes - origin))
        self.met.set_verts(list(_first_contact(trace, planned, reason_of(trace, planned)) - origin))
        framed = np.zeros(scene.vehicles, dtype=bool) if left is None else left[moment]
        self.frames.set_verts(list(body_corners(scene.states, scene.half_sizes + _FRAME)[framed] - origin))
        return scene

    def show(self, scene: Scene, paths: PredictedPaths, plan: Plan) -> None:
        """Show an unbatched scene with the ego in slot 0, and what was predicted and planned in it."""
        origin = np.array([float(scene.lon[EGO]), 0.0])
        boxes = set_boxes(paths) - origin if len(paths) else []
        self.sets.set_paths([Path.make_compound_path_from_polys(moment) for moment in boxes[::-1]])
        self.sets.set_facecolor(style.SETS(np.linspace(1, 0, len(boxes))).tolist())
        self.members.set_segments(list(paths.points - origin))
        self.members.set_alpha(min(0.4, 30 / max(len(paths), 1)))
        self.plan.set_data(*(plan.states[:, :2] - origin).T)
        self.fail_safe.set_data(*(plan.held[:, :2] - origin).T)
        times = plan.dt * np.arange(len(plan.states))
        full = np.isclose(times, np.round(times)) & (times > 0.5)
        self.bodies.set_verts(list(body_corners(plan.held[full], scene.half_sizes[EGO]) - origin))
        self.bodies.set_edgecolor(style.TIMES(times[full] / times.max(initial=1.0)).tolist())
        corners, valid = body_corners(scene.states, scene.half_sizes) - origin, np.asarray(scene.valid)
        colours = [to_rgba(style.EGO if slot == EGO else style.OTHER) for slot in np.flatnonzero(valid)]
        self.vehicles.set_verts(list(corners[valid]))
        self.vehicles.set_facecolor(colours)
        for slot, text in enumerate(self.speeds):
            lon, lat = corners[slot].mean(0)
            text.set_position((lon, lat))
            whole = _NUMBER - BEHIND <= lon <= AHEAD - _NUMBER
            text.set_text(f"{scene.speed[slot]:.0f}" if valid[slot] and whole else "")
        ends = origin[0] - BEHIND, origin[0] + AHEAD
        self.dashes.set_segments(list(dashes(self._road, *ends) - origin))
        shown = markings(self._road, *ends)
        right, left = (line.points - origin for line in shown if line.outer)
        self.surface.set_verts([np.concatenate([right, left[::-1]])])
        self.borders.set_segments([right, left])


def _first_contact(trace: Trace, step: int, reason: Reason) -> Float[np.ndarray, "_ 4 2"]:
    """Corners [m] of the box and of the ego where a plan that is not clear meets a path; none if it does not."""
    if reason.path < 0:
        return np.zeros((0, 4, 2))
    paths, plan = trace.paths[step], trace.plans[step]
    low = min(int(reason.time / plan.dt), len(plan.states) - 2)
    point, half_size, state = (
        each[low] + (reason.time / plan.dt - low) * (each[low + 1] - each[low])
        for each in (paths.points[reason.path], paths.half_sizes[reason.path], plan.held)
    )
    return np.stack([point + CORNERS * half_size, body_corners(state, trace.scene.half_sizes[step, EGO])])


def set_boxes(paths: PredictedPaths) -> Float[np.ndarray, "_ S 4 2"]:
    """Corners [m] of the boxes of all paths, with one more halfway between two, so that fast vehicles leave no gaps."""
    boxes = _path_boxes(paths)
    return np.swapaxes(np.insert(boxes, range(1, boxes.shape[1]), (boxes[:, :-1] + boxes[:, 1:]) / 2, axis=1), 0, 1)


def _path_boxes(paths: PredictedPaths) -> Float[np.ndarray, "S P 4 2"]:
    """Corners [m] of the boxes of all paths at each of their points, all turning the same way."""
    return paths.points[:, :, None] + CORNERS * paths.half_sizes[:, :, None]
