"""Small NGSIM files of known content."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

sys.path.insert(0, str(Path(__file__).parent))

FOOT = 0.3048
COLUMNS = [
    "Vehicle_ID",
    "Frame_ID",
    "Total_Frames",
    "Global_Time",
    "Local_X",
    "Local_Y",
    "Global_X",
    "Global_Y",
    "v_length",
    "v_Width",
    "v_Class",
    "v_Vel",
    "v_Acc",
    "Lane_ID",
    "O_Zone",
    "D_Zone",
    "Int_ID",
    "Section_ID",
    "Direction",
    "Movement",
    "Preceding",
    "Following",
    "Space_Headway",
    "Time_Headway",
    "Location",
]
TEXT_COLUMNS = COLUMNS[:14] + COLUMNS[20:24]


def ngsim_table(
    vehicles: int = 6,
    seconds: float = 10.0,
    speed: float = 15.0,
    location: str = "us-101",
    start: int = 1_118_846_980_200,
    first_frame: int = 10,
) -> pl.DataFrame:
    """Vehicles at constant speed [m/s], side by side in three lanes of 12 ft, as the portal writes them (feet)."""
    rows = round(seconds * 10)
    vehicle = np.repeat(np.arange(1, vehicles + 1), rows)
    frame = np.tile(np.arange(rows), vehicles)
    lane = (vehicle - 1) % 3 + 1
    columns: dict[str, object] = dict.fromkeys(COLUMNS)
    columns |= {
        "Vehicle_ID": vehicle,
        "Frame_ID": first_frame + frame,
        "Total_Frames": np.full(len(vehicle), rows),
        "Global_Time": start + 100 * frame,
        "Local_X": np.round(12.0 * lane - 6.0, 3),
        "Local_Y": np.round((50.0 * vehicle + speed * frame / 10) / FOOT, 3),
        "v_length": np.full(len(vehicle), 15.0),
        "v_Width": np.full(len(vehicle), 6.0),
        "v_Class": np.full(len(vehicle), 2),
        "v_Vel": np.full(len(vehicle), round(speed / FOOT, 2)),
        "v_Acc": np.zeros(len(vehicle)),
        "Lane_ID": lane,
        "Preceding": np.zeros(len(vehicle), dtype=int),
        "Following": np.zeros(len(vehicle), dtype=int),
        "Space_Headway": np.zeros(len(vehicle)),
        "Time_Headway": np.zeros(len(vehicle)),
        "Location": location,
    }
    return pl.DataFrame(columns)


@pytest.fixture
def make_ngsim() -> Callable[..., pl.DataFrame]:
    return ngsim_table


@pytest.fixture
def write_csv(tmp_path: Path) -> Callable[[pl.DataFrame], Path]:
    def write(table: pl.DataFrame, name: str = "traffic.csv") -> Path:
        table.write_csv(tmp_path / name)
        return tmp_path / name

    return write


@pytest.fixture
def write_text(tmp_path: Path) -> Callable[[pl.DataFrame], Path]:
    def write(table: pl.DataFrame, name: str = "traffic.txt") -> Path:
        lines = ["".join(f"{value or 0!s:>15}" for value in row) for row in table.select(TEXT_COLUMNS).iter_rows()]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return tmp_path / name

    return write
