"""What is in recordings, for people: one line for each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverdrive.recordings.recording import Recording


@dataclass(frozen=True)
class Summary:
    """One recording in a few numbers."""

    name: str
    groups: tuple[int, ...]
    """groups that its rows belong to, ascending"""
    vehicles: int
    """number of tracks"""
    minutes: float
    """[min] from the first to the last row"""
    rows: int
    """one for each vehicle and moment"""
    lanes: int
    mean_speed: float
    """[m/s] over all rows"""
    max_speed: float
    """[m/s]"""
    dt: float
    """[s]"""
    repairs: dict[str, int]
    """how often each kind of repair was made"""
    notes: dict[str, str]
    """format, where the lanes are from, how it was resampled"""


def summarise(recordings: Sequence[Recording]) -> list[Summary]:
    """The summary of every recording, in their order."""
    return [
        Summary(
            name=recording.name,
            groups=tuple(recording.table["group"].unique().sort()),
            vehicles=recording.table["vehicle"].n_unique(),
            minutes=float(np.ptp(recording.table["time"].to_numpy())) / 60,
            rows=len(recording.table),
            lanes=recording.road.lanes,
            mean_speed=float(recording.table["speed"].to_numpy().mean()),
            max_speed=float(recording.table["speed"].to_numpy().max()),
            dt=recording.dt,
            repairs=recording.repairs,
            notes=recording.notes,
        )
        for recording in recordings
    ]
