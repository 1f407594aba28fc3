"""What a vehicle does in a window, by which misses are told apart: a rare manoeuvre is lost in the sum of all.

A *cut-in* is a lane change that ends ahead of another vehicle, of the ego in the closed loop, and in its way, in which
the vehicle was not before. N windows.
"""

from collections.abc import Sequence

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int

from coverdrive.prediction.data.segments import Segments
from coverdrive.recordings.recording import Recording

MANOEUVRES = {
    "cut_in": "cut-in",
    "lane_change": "lane change",
    "hard": "hard braking or acceleration",
    "rest": "the rest",
}
"""the first of them that a window is, and in words"""

ACROSS, ALONG = 1.5, 6.0
"""[m] within a window: farther across is a lane change; farther along from constant velocity is hard"""

AHEAD = 50.0
"""[m] of centres within which a vehicle cuts in"""


def manoeuvres(
    deviation: Float[np.ndarray, "*N 2"], cuts_in: Bool[np.ndarray, "*N"]
) -> dict[str, Bool[np.ndarray, "*N"]]:
    """Which windows are which of `MANOEUVRES`.

    ``deviation`` [m] is from constant velocity along the road, at the end; lane changes cut in if ``cuts_in``.
    """
    changes = np.abs(deviation[..., 1]) > ACROSS
    kinds = [changes & cuts_in, changes, np.abs(deviation[..., 0]) > ALONG]
    kind = np.select(kinds, range(len(kinds)), len(kinds))
    return {name: kind == number for number, name in enumerate(MANOEUVRES)}


def gets_in_the_way(
    own: Float[np.ndarray, "2 *N 2"], other: Float[np.ndarray, "2 *N 2"], reach: Float[np.ndarray, "*N"]
) -> Bool[np.ndarray, "*N"]:
    """Whether vehicles are, at the end, ahead of others and in their way, but were not in it at the start.

    ``own`` and ``other`` are centres (lon, lat) [m] at the start and at the end, ``reach`` half the sum of widths.
    """
    apart = own - other
    beside = np.abs(apart[..., 1]) >= reach
    return beside[0] & ~beside[1] & (apart[1, ..., 0] > 0) & (apart[1, ..., 0] <= AHEAD)


def manoeuvres_of(recordings: Sequence[Recording], segments: Segments) -> dict[str, Bool[np.ndarray, " N"]]:
    """Which segments of recordings are which of `MANOEUVRES`; cut-ins are ahead of anybody."""
    cuts_in = np.zeros(len(segments), dtype=bool)
    changes = np.abs(segments.points[:, -1, 1]) > ACROSS
    for number in np.unique(segments.recording[changes]):
        own = np.flatnonzero(changes & (segments.recording == number))
        horizon = segments.step * (segments.points.shape[1] - 1)
        cuts_in[own[_cutting_in(recordings[number], segments.row[own], horizon)]] = True
    return manoeuvres(segments.points[:, -1], cuts_in)


def _cutting_in(recording: Recording, rows: Int[np.ndarray, " n"], horizon: float) -> Int[np.ndarray, " c"]:
    """Which of the windows that start in some rows of a table get in the way of any other vehicle."""
    moment = (pl.col("time") / recording.dt).round().cast(pl.Int64)
    table = recording.table.select("vehicle", "group", "lon", "lat", "width", moment=moment)
    start = table[rows].with_row_index("window").with_columns(end=pl.col("moment") + round(horizon / recording.dt))
    pairs = start.join(table, on=("group", "moment"), suffix="_b").filter(pl.col("vehicle") != pl.col("vehicle_b"))
    last = table.select("vehicle", "moment", "lon", "lat")
    for vehicle in ("vehicle", "vehicle_b"):
        pairs = pairs.join(last, left_on=(vehicle, "end"), right_on=("vehicle", "moment"), suffix=f"_{vehicle}_end")
    own, other = (
        np.stack([pairs.select(f"lon{at}", f"lat{at}").to_numpy() for at in ats])
        for ats in (("", "_vehicle_end"), ("_b", "_vehicle_b_end"))
    )
    reach = (pairs["width"] + pairs["width_b"]).to_numpy() / 2
    return np.unique(pairs["window"].to_numpy().astype(np.int64)[gets_in_the_way(own, other, reach)])
