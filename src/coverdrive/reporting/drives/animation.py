"""One drive as a video (H.264 in MP4, or GIF) that plays in real time.

Above the road as in the snapshots, below it what the ego did so far: its speed, gap and time to collision, how long
each plan took and how it was found. The still parts are drawn once; every frame draws only what moves.

A GIF has one palette for all frames: the colours of `coverdrive.reporting.plotting.style` and their blends. A palette
made from the frames would miss what is rare, and one for every frame would flicker.
"""

import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from jaxtyping import Float, UInt8
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from coverdrive.errors import SettingError
from coverdrive.files import write_atomically
from coverdrive.plan import Status
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.progress import done, stage
from coverdrive.reporting.drives.reasons import Reason, reason_of
from coverdrive.reporting.drives.road_drawing import RoadDrawing, height_of
from coverdrive.reporting.drives.snapshots import LINE, add_legend, in_lines
from coverdrive.reporting.drives.worst_moment import worst_moment
from coverdrive.reporting.plotting import style
from coverdrive.road_markings import ahead_label
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import find_windows, left_recently
from coverdrive.simulation.roads.initial import EGO

HOLD = 1.0
"""[s] that the last moment is shown, and that the worst one is named"""

_WIDTH, _DPI = 1600, 200
_GIF_WIDTH = 1200
"""[pixel]"""
_SHADES = 8
"""of the palette of a GIF, from one colour to another"""
_BESIDE, _BELOW, _ABOUT = 0.6, 1.0, 1.85
"""[inch] labels of the lanes, panels below the road, and legends, title and axes"""
_MULTIPLE = 16
"""[pixel] of which the sides are multiples, so that no player has to scale"""

_MOST = 10.0
"""[m], [s] that gaps and times to collision are shown up to; what is more leaves the panel"""

_MARKERS = {Status.SOLVED: "o", Status.FALLBACK: "s", Status.UNSAFE: "X", Status.INVALID_INPUT: "P"}


def animate(trace: Trace, path: Path, problem: ProblemSettings | None = None) -> None:
    """Write a video of a trace, ``.mp4`` or ``.gif``: a frame for every moment, and the last one held for a second.

    The folder is made if need be. Active constraints of the planner's ``problem`` are marked, if it is known.
    """
    write = _WRITERS.get(path.suffix)
    if write is None:
        raise SettingError(f"a video is MP4 or GIF, got the file name {path.name!r}; let it end in .mp4 or .gif")
    period = float(trace.time[1] - trace.time[0])
    moments = [*range(len(trace) + 1), *[len(trace)] * round(HOLD / period)]
    with stage("video"), style.style():
        frames, ends = _frames(trace, moments, problem), period * np.arange(1, len(moments) + 1)
        write_atomically(path, lambda temporary: write(temporary, frames, ends))


def _write_mp4(path: Path, frames: Iterator[memoryview], ends: Float[np.ndarray, " _"]) -> None:
    """H.264 in the pixel format that every player knows, with the index in front; frames end [s] after equal times."""
    with av.open(path, "w", format="mp4", options={"movflags": "+faststart"}) as video:
        stream = video.add_stream("libx264", Fraction(1 / float(ends[0])).limit_denominator(1000))
        stream.pix_fmt = "yuv420p"
        stream.options = {"preset": "veryfast", "crf": "21"}
        for pixels in frames:
            frame = av.VideoFrame.from_ndarray(np.asarray(pixels), format="rgba")
            if not stream.codec_context.is_open:
                stream.width, stream.height = frame.width, frame.height
            video.mux(stream.encode(frame))
        video.mux(stream.encode(None))


def _frames(trace: Trace, moments: list[int], problem: ProblemSettings | None) -> Iterator[memoryview]:
    """The picture of every moment as RGBA pixels, valid until the next one is asked for."""
    reasons = [reason_of(trace, step) for step in range(len(trace))]
    reasons = [reason._replace(text=in_lines(reason.text)) for reason in reasons]
    road = height_of(trace.road, _WIDTH / _DPI - _BESIDE)
    above = _ABOUT + LINE * _more_lines(reasons)
    height = _MULTIPLE * math.ceil((above + road + _BELOW) * _DPI / _MULTIPLE)
    figure = style.new_figure(_WIDTH / _DPI, height / _DPI)
    figure.set_dpi(_DPI)
    canvas = FigureCanvasAgg(figure)
    picture = _Picture(figure, trace, problem, road, reasons)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)  # pyright: ignore[reportAttributeAccessIssue]
    for count, moment in enumerate(moments, start=1):
        picture.show(moment)
        canvas.restore_region(still)
        for artist in picture.moving:
            artist.draw(canvas.get_renderer())
        yield canvas.buffer_rgba()
        done(count, len(moments))


def _more_lines(reasons: list[Reason]) -> int:
    """Lines after the first that the longest reason needs."""
    return max(reason.text.count("\n") for reason in reasons)


class _Picture:
    """The artists of the video's frames."""

    def __init__(
        self, figure: Figure, trace: Trace, problem: ProblemSettings | None, height: float, reasons: list[Reason]
    ):
        windows = find_windows(trace)
        self._trace, self._problem, self._left = trace, problem, left_recently(trace, windows)
        self._worst = worst_moment(trace, windows)
        self._speed = np.asarray(trace.scene.speed[:, EGO])
        self._milliseconds = 1000 * trace.planning_seconds
        self._reasons = reasons
        grid = figure.add_gridspec(2, 4, height_ratios=(height, _BELOW))
        road = figure.add_subplot(grid[0, :])
        road.set_xlabel(ahead_label(trace.road))
        road.set_title(" \n " + "\n " * _more_lines(reasons), loc="left")
        self._drawing = RoadDrawing(road, trace.road, trace.scene.vehicles)
        self._title = road.text(0, 1.04, "", transform=road.transAxes, fontsize=8)
        met = any(reason.path >= 0 for reason in self._reasons)
        add_legend(figure, trace.horizon, problem is not None, bool(self._left.any()), met)
        courses = (
            ("ego speed [m/s]", self._speed, max(self._speed.max(), 1.0)),
            ("gap [m]", np.minimum(gaps(trace), 2 * _MOST), _MOST),
            ("to collision [s]", np.minimum(distances(trace).time_to_collision, 2 * _MOST), _MOST),
        )
        self._courses = {
            _over_time(figure.add_subplot(grid[1, k]), trace, label, most).plot([], [], color=style.EGO)[0]: values
            for k, (label, values, most) in enumerate(courses)
        }
        planning = figure.add_subplot(grid[1, 3])
        self._status_dots = _planning_panel(planning, trace, self._milliseconds)
        figure.legend(
            *planning.get_legend_handles_labels(), loc="outside lower right", ncols=1 + len(self._status_dots)
        )
        self.moving: tuple[Artist, ...] = (
            *self._drawing.artists, self._title, *self._courses, *self._status_dots.values()
        )  # fmt: skip
        for artist in self.moving:
            artist.set_animated(True)

    def show(self, moment: int) -> None:
        """Move the artists to one moment of the trace."""
        trace = self._trace
        self._drawing.show_moment(trace, moment, self._problem, self._left)
        title, since = f"{trace.time[moment]:.1f} s, ego {self._speed[moment]:.1f} m/s", trace.time[self._worst.moment]
        if self._worst.slot >= 0 and since <= trace.time[moment] < since + HOLD:
            title += f", {self._worst.name} {since:.1f} s"
        if moment < len(trace) and trace.plans[moment].status is not Status.SOLVED:
            title += f", plan {trace.plans[moment].status.value}"
            title += f"\n{self._reasons[moment].text}" * bool(self._reasons[moment].text)
        if moment == len(trace) and trace.outcome.kind is not Kind.FINISHED:
            title += f": {trace.outcome.kind.value} collision"
        self._title.set_text(title)
        for line, values in self._courses.items():
            line.set_data(trace.time[: moment + 1], values[: moment + 1])
        statuses = [plan.status for plan in trace.plans[: moment + 1]]
        for status, dots in self._status_dots.items():
            steps = [step for step, other in enumerate(statuses) if other is status]
            dots.set_data(trace.time[steps], self._milliseconds[steps])


def _over_time(axes: Axes, trace: Trace, label: str, largest: float) -> Axes:
    axes.set(xlim=(0, trace.time[-1]), ylim=(0, 1.1 * largest), xlabel="time [s]", ylabel=label)
    axes.locator_params(nbins=5, steps=[1, 2, 5, 10])
    axes.grid(True)
    return axes


def _planning_panel(axes: Axes, trace: Trace, milliseconds: np.ndarray) -> dict[Status, Line2D]:
    """One set of dots for every way in which a plan of the drive was found, and the time there is for a plan."""
    period = 1000 * float(trace.time[1] - trace.time[0])
    _over_time(axes, trace, "planning [ms]", max(milliseconds.max(), period))
    axes.axhline(period, color=style.GREY, linestyle="--", linewidth=0.9, label="next plan due")
    look: dict[str, Any] = {"linestyle": "none", "markersize": 2.5}
    return {
        status: axes.plot([], [], color=style.STATUS[status], marker=marker, label=status.value, **look)[0]
        for status, marker in _MARKERS.items()
        if any(plan.status is status for plan in trace.plans)
    }


def _write_gif(path: Path, frames: Iterator[memoryview], ends: Float[np.ndarray, " _"]) -> None:
    """A GIF that plays for ever; its frames last whole hundredths of a second, and end [s] as near as can be."""
    milliseconds = 10 * np.diff(np.rint(100 * ends).astype(int), prepend=0)
    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette().ravel().tolist())
    pictures = (_small(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first = next(pictures)
    first.save(
        path, format="GIF", save_all=True, append_images=pictures, duration=milliseconds.tolist(), loop=0,
        optimize=False,
    )  # fmt: skip


def _small(frame: memoryview) -> Image.Image:
    picture = Image.fromarray(np.asarray(frame)).convert("RGB")
    height = round(_GIF_WIDTH * picture.height / picture.width)
    return picture.resize((_GIF_WIDTH, height), Image.Resampling.LANCZOS)


def _palette() -> UInt8[np.ndarray, "_ 3"]:
    """All colours that a frame is drawn with, blended into what they are drawn on."""
    sets = [style.SETS(age)[:3] for age in np.linspace(0, 1, 24)]
    inks = (style.EGO, style.OTHER, style.GREEN, style.ORANGE, style.PURPLE, style.BAD, style.BLACK, style.GREY)
    blends = [(ink, "white") for ink in inks]
    blends += [(style.TIMES(age)[:3], style.SETS(age)[:3]) for age in (0.33, 0.67, 1.0)]
    blends += [(ink, sets[8]) for ink in (style.EGO, style.OTHER, style.MARKING, "white")]
    blends += [(ink, style.ROAD) for ink in (style.EGO, style.OTHER, style.MARKING)]
    share = np.linspace(0, 1, _SHADES)[:, None]
    shades = [share * to_rgb(above) + (1 - share) * to_rgb(below) for above, below in blends]
    colours = np.concatenate([np.array(sets), *shades])
    return np.unique((255 * colours).round().astype(np.uint8), axis=0)


_WRITERS = {".mp4": _write_mp4, ".gif": _write_gif}
"""by the suffix of the file"""
