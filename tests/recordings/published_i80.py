"""Writes traffic as NGSIM published I-80: six lanes, and on-ramp 7 that joins lane 6; original text and portal CSV.

Feet; front centres; ``Local_X`` from the left edge; lane 1 is the leftmost; only vehicles that were seen all the way.
"""

from pathlib import Path
from typing import Literal

import numpy as np
import polars as pl
from recordings_fakes import COLUMNS, TEXT_COLUMNS

LANE = 12.0
"""[ft]"""

END, JOINS, MERGES = 1650.0, (60.0, 180.0), (260.0, 690.0)
"""[ft] of the section; where the ramp comes in view and beside lane 6; where the first and the last vehicle leave it"""

RAMP, LAST = 7, 6


def i80(seconds: float = 100.0, phase: float = 0.0, start: int = 1_113_433_135_300) -> pl.DataFrame:
    """Vehicles of one length at the same varying speed, in the middle of the gaps of the lanes beside."""
    time = np.arange(0, seconds, 0.1)
    swing = 2 * np.pi * (time + phase) / 25
    speed = 42 + 6 * np.sin(swing)  # [ft/s]
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.1)])
    parts: list[pl.DataFrame] = []
    for lane in range(1, RAMP + 1):
        for number in range(int(way[-1] / 200)):
            along = way - 200.0 * number - 100.0 * (lane % 2) - 30.0
            seen = (along >= (JOINS[0] if lane == RAMP else 0.0)) & (along <= END)
            if along[-1] < END or not seen.any():
                continue
            name, place = 100 * lane + number, along[seen]
            middle = np.full(len(place), lane - 0.5)
            if lane == RAMP:  # from 18 ft farther to the right, beside lane 6, then into it over 130 ft
                middle += 1.5 * np.interp(place, JOINS, (1.0, 0.0))
                middle -= _change(place, np.interp(number * 0.618 % 1, (0, 1), MERGES))
            elif lane == 4 and number % 3 == 0:
                middle -= _change(place, 600.0 + 20 * number)
            right = LANE * middle + 0.8 * np.sin(place / 90 + name)
            parts.append(
                pl.DataFrame(
                    {
                        "Vehicle_ID": name,
                        "Frame_ID": np.flatnonzero(seen) + 1,
                        "Total_Frames": len(place),
                        "Global_Time": start + 100 * np.flatnonzero(seen),
                        "Local_X": right.round(3),
                        "Local_Y": place.round(3),
                        "Global_X": 0.0,
                        "Global_Y": 0.0,
                        "v_length": 15.0,
                        "v_Width": 6.0,
                        "v_Class": 2,
                        "v_Vel": speed[seen].round(2),
                        "v_Acc": 0.0,
                        "Lane_ID": np.clip(np.floor(right / LANE).astype(int) + 1, 1, RAMP),
                    }
                )
            )
    table = pl.concat(parts)
    return table.with_columns(**{name: pl.lit(0) for name in COLUMNS if name not in table.columns}).select(COLUMNS)


def _change(place: np.ndarray, across: float) -> np.ndarray:
    """Share of a lane change whose half is at a place [ft]."""
    share = np.clip((place - across) / 130 + 0.5, 0, 1)
    return share * share * (3 - 2 * share)


def write_i80(folder: Path, table: pl.DataFrame, form: Literal["csv", "txt"], name: str = "trajectories-0400") -> Path:
    """A table of `i80` in one of the two forms."""
    path = folder / f"{name}.{form}"
    if form == "csv":
        table.with_columns(Location=pl.lit("i-80")).write_csv(path)
    else:
        rows = table.select(TEXT_COLUMNS).iter_rows()
        path.write_text("".join(" ".join(f"{value:>12}" for value in row) + "\n" for row in rows))
    return path
