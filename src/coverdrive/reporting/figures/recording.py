"""What was recorded, as pictures: the road with its lanes and the tracks on it, and how speeds, gaps and accelerations
are distributed, in which a wrong unit shows.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from coverdrive.percentages import counted
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.summary import accelerations, following
from coverdrive.reporting.plotting import style

MOST_PIECES = 60_000
"""of tracks that are drawn; of longer recordings, every so many-th row"""

_SPEEDS = "viridis"

_STATION = 2.0
"""[m] between two points of a drawn lane edge"""


def road_figure(recording: Recording) -> Figure:
    """The road on the map and laid straight, with all tracks in the colour of their speed, and each lane over time."""
    road, table = recording.road, recording.table
    lon, lat, time, speed = (table[name].to_numpy() for name in ("lon", "lat", "time", "speed"))
    lane = np.asarray(road.lane_at(lon, lat))
    pieces = _pieces(recording)
    norm = Normalize(0.0, max(float(np.quantile(speed, 0.999)), 1.0))
    used = [each for each in range(road.lanes) if np.any(lane == each)][::-1]
    with style.style():
        figure = style.new_figure(style.TWO_COLUMNS, 3.6 + 2.2)
        above, below = figure.subfigures(2, 1, height_ratios=(3.4, 2.4), squeeze=False)[:, 0]
        world, straight = above.subplots(2, 1)
        _draw_map(world, recording, pieces, norm)
        _draw_lanes(straight, recording)
        tracks = _tracks(straight, np.stack([lon, lat], axis=-1), pieces, speed, norm)
        straight.set(xlabel="lon [m]", ylabel="lat [m]")
        above.colorbar(tracks, ax=[world, straight], label="speed [m/s]", pad=0.01, aspect=30)
        for axes, each in zip(
            below.subplots(1, len(used), sharex=True, sharey=True, squeeze=False)[0], used, strict=True
        ):
            inside = pieces[(lane[pieces[:, 0]] == each) & (lane[pieces[:, 1]] == each)]
            _tracks(axes, np.stack([time, lon], axis=-1), inside, speed, norm)
            axes.set(xlabel="time [s]", ylabel="lon [m]" if each == used[0] else "")
            axes.set_title(f"lane {each}", loc="left")
            axes.autoscale_view()
        figure.suptitle(f"{recording.name}, {counted(table['vehicle'].n_unique(), 'vehicle')}", fontsize=8)
    return figure


def histogram_figure(recordings: Sequence[Recording]) -> Figure:
    """How often speeds, gaps and accelerations occur in recordings, with the median and the range of 98 % of them."""
    joined = {
        "speed [m/s]": [recording.table["speed"].to_numpy() for recording in recordings],
        "gap to the vehicle ahead [m]": [following(recording)["gap"].to_numpy() for recording in recordings],
        "acceleration [m/s²]": [accelerations(recording) for recording in recordings],
    }
    with style.style():
        figure = style.new_figure(style.TWO_COLUMNS, 2.2)
        for axes, (label, parts) in zip(figure.subplots(1, len(joined)), joined.items(), strict=True):
            values = np.concatenate(parts)
            axes.set(xlabel=label, yticks=[])
            axes.spines["left"].set_visible(False)
            if len(values) == 0:
                axes.set_title("none", loc="left")
                continue
            low, median, high = np.quantile(values, (0.01, 0.5, 0.99))
            margin = 0.1 * max(high - low, 0.1)
            axes.hist(values, bins=60, range=(low - margin, high + margin), color=style.BLUE, alpha=0.8)
            axes.axvline(median, color=style.BLACK, linewidth=0.8)
            least, middle, most = (f"{value:.2f}".replace("-", "−") for value in (low, median, high))
            axes.set_title(f"median {middle}, 98 % from {least} to {most}", loc="left")
    return figure


def _pieces(recording: Recording) -> Int[np.ndarray, "n 2"]:
    """Pairs of rows of one track between which it is drawn."""
    table = recording.table
    every = -(-len(table) // MOST_PIECES)
    vehicle, moment = table["vehicle"].to_numpy(), np.rint(table["time"].to_numpy() / recording.dt)
    kept = np.flatnonzero((moment % every == 0) | (np.diff(vehicle, prepend=vehicle[:1] - 1) != 0))
    pairs = np.stack([kept[:-1], kept[1:]], axis=-1)
    return pairs[(vehicle[pairs[:, 0]] == vehicle[pairs[:, 1]]) & (np.diff(moment[pairs])[:, 0] <= every + 0.5)]


def _tracks(
    axes: Axes, places: Float[np.ndarray, "R 2"], pieces: Int[np.ndarray, "n 2"], speed: np.ndarray, norm: Normalize
) -> LineCollection:
    """Draw pieces of tracks between places, in the colour of their speed."""
    look: dict[str, Any] = {"cmap": _SPEEDS, "norm": norm, "linewidths": 0.6, "rasterized": True}
    lines = LineCollection(list(places[pieces]), array=speed[pieces[:, 0]], **look)
    axes.add_collection(lines)
    return lines


def _stations(recording: Recording) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S E"]]:
    lon = np.linspace(0.0, float(recording.road.length), max(2, round(float(recording.road.length) / _STATION)))
    return lon, np.asarray(recording.road.edges_at(lon), dtype=float)


def _draw_map(axes: Axes, recording: Recording, pieces: Int[np.ndarray, "n 2"], norm: Normalize) -> None:
    """The road as it lies, turned so that it leads to the right, with its edges and tracks."""
    lon, edges = _stations(recording)
    road, table = recording.road, recording.table
    first, last = (np.stack(road.to_map(at, np.zeros(1)))[:, 0] for at in (lon[:1], lon[-1:]))
    angle = np.arctan2(*(last - first)[::-1])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def placed(lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
        return (np.stack(road.to_map(lon, lat), axis=-1) - first) @ turn.T

    borders = [placed(lon, edges[:, side]) for side in (0, -1)]
    outline = np.concatenate([borders[0], borders[1][::-1]])
    axes.add_collection(PolyCollection([outline], facecolor=style.ROAD, edgecolor=style.MARKING, linewidth=0.5))
    for edge in edges[:, 1:-1].T:
        axes.plot(*placed(lon, edge).T, color=style.MARKING, linewidth=0.3, zorder=1)
    _tracks(axes, placed(table["lon"].to_numpy(), table["lat"].to_numpy()), pieces, table["speed"].to_numpy(), norm)
    axes.set(aspect="equal", xlabel="on the map [m], turned to the right", yticks=[])
    axes.autoscale_view()


def _draw_lanes(axes: Axes, recording: Recording) -> None:
    """The road laid straight: the lanes where they are there, with their edges."""
    lon, edges = _stations(recording)
    there = recording.road.has_lane(lon)
    for lane in range(recording.road.lanes):
        right, left = edges[:, lane], edges[:, lane + 1]
        axes.fill_between(lon, right, left, where=there[:, lane], facecolor=style.ROAD, linewidth=0, zorder=0)
        for edge in (right, left):
            axes.plot(lon, np.where(there[:, lane], edge, np.nan), color=style.MARKING, linewidth=0.6, zorder=1)
    axes.set(xlim=(lon[0], lon[-1]), ylim=(edges.min() - 2, edges.max() + 2))
