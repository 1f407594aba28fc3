"""The road's line from tracks alone, on bends whose middle is known."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import RecordingError
from coverdrive.recordings.map_tracks import MapTracks, readings_from_map
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.tracks.smoothing import SmoothingSettings

STRAIGHT, STEP = 200.0, 0.25
"""[m] of road before and after the bends, and between two points of its middle"""


def middle(*turns: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and headings [rad] of a road that turns by angles [degrees] at radii [m], to the left if positive."""
    arcs = [np.full(round(np.radians(abs(turn)) * radius / STEP), np.sign(turn) / radius) for radius, turn in turns]
    straight = np.zeros(round(STRAIGHT / STEP))
    heading = np.cumsum(np.concatenate([straight, *arcs, straight])) * STEP
    return np.cumsum(np.exp(1j * heading)) * STEP, heading


def recorded(road: tuple[np.ndarray, np.ndarray], vehicles: int = 6, changing: float = 0.0) -> Recording:
    """What is read of vehicles in the middle of three lanes of 3.5 m, of which the first moves ``changing`` m aside."""
    points, heading = road
    rows = np.arange(8, len(points) - 8, round(1.5 / STEP))
    tables = list[pl.DataFrame]()
    for vehicle in range(vehicles):
        left = 3.5 * (vehicle % 3 - 1) + (vehicle == 0) * changing * np.clip((rows * STEP - 200) / 60, 0, 1)
        place = points[rows] + 1j * left * np.exp(1j * heading[rows])
        time = 2.0 * vehicle + 0.1 * np.arange(len(rows))
        tables.append(pl.DataFrame({"vehicle": vehicle, "time": time, "x": place.real, "y": place.imag}))
    tracks = MapTracks("bend", pl.concat(tables).with_columns(length=4.5, width=1.8), dt=0.1)
    (reading,) = readings_from_map(Path("bend.csv"), tracks, SmoothingSettings())
    return reading.recording


@pytest.mark.parametrize("vehicles", [3, 24])
@pytest.mark.parametrize(
    "turns", [[(80, 20)], [(80, -40)], [(100, 40)], [(150, 20)], [(150, 55)], [(100, 40), (100, -40)]], ids=str
)
def test_bends_are_followed(turns: list[tuple[float, float]], vehicles: int):
    road = middle(*turns)
    recording = recorded(road, vehicles)
    inside = road[0][100:-100]
    lat = recording.road.to_road(inside.real, inside.imag)[1]
    assert np.abs(lat - np.median(lat)).max() < 0.3
    assert np.diff(recording.road.edges) == pytest.approx([3.5, 3.5, 3.5], abs=0.05)


@pytest.mark.parametrize("turns", [[(30, 30)], [(60, 20), (60, -20)]], ids=str)
def test_bends_that_no_line_follows_are_refused(turns: list[tuple[float, float]]):
    with pytest.raises(RecordingError, match=r"bends by \d° more than .* 60 m radius; name its map, or leave it out"):
        recorded(middle(*turns))


def test_a_lane_change_is_no_bend():
    recording = recorded(middle(), vehicles=3, changing=3.5)
    assert np.abs(recording.road.curvature(np.linspace(20, 380, 50))).max() < 1e-3
