"""Pictures of recordings show every track and every lane."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from coverdrive.recordings.recording import Recording
from coverdrive.reference_line import ReferenceLine
from coverdrive.reporting.figures import recording as recording_figures
from coverdrive.reporting.figures.recording import histogram_figure, road_figure
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate


@pytest.fixture(scope="module")
def recording() -> Recording:
    return generate(GeneratedSettings(scenes=1, duration=6.0))[0]


def pieces(axes: Axes) -> list[np.ndarray]:
    (lines,) = [each for each in axes.collections if isinstance(each, LineCollection)]
    return [path.vertices for path in lines.get_paths()]


def test_all_tracks_are_drawn(recording: Recording):
    world, straight, *lanes = road_figure(recording).axes[:2] + road_figure(recording).axes[3:]
    table = recording.table
    steps = len(table) - table["vehicle"].n_unique()
    assert len(pieces(world)) == len(pieces(straight)) == steps
    ends = {tuple(piece[0]) for piece in pieces(straight)}
    assert {(lon, lat) for lon, lat in table.select("lon", "lat").head(50).iter_rows()} <= ends
    used = np.unique(recording.road.lane_of(table["lat"].to_numpy()))
    assert [axes.get_title("left") for axes in lanes] == [f"lane {lane}" for lane in used[::-1]]
    changes = steps - sum(len(pieces(axes)) for axes in lanes)
    assert 0 <= changes < 0.02 * steps  # those between two lanes


def test_a_bend_is_drawn_as_a_bend(recording: Recording):
    length = float(recording.road.length)
    line = ReferenceLine(np.array([50.0, 60.0]), 2.0, np.full(2001, 1 / length), length)
    bent = replace(recording.road, line=line)
    table = recording.table.with_columns(
        speed=recording.table["speed"] * bent.stretch(*recording.table.select("lon", "lat").to_numpy().T)
    )
    world, straight = road_figure(replace(recording, table=table, road=bent)).axes[:2]
    chord = 2 * length * np.sin(0.5)
    assert np.ptp(world.dataLim.intervalx) == pytest.approx(chord, abs=30)
    assert np.ptp(world.dataLim.intervaly) == pytest.approx(length * (1 - np.cos(0.5)), abs=30)
    assert straight.get_xlim() == pytest.approx((0, length))


def test_long_recordings_are_thinned_out(recording: Recording, monkeypatch: pytest.MonkeyPatch):
    whole = len(pieces(road_figure(recording).axes[0]))
    monkeypatch.setattr(recording_figures, "MOST_PIECES", len(recording.table) // 4)
    found = pieces(road_figure(recording).axes[0])
    assert whole / 6 < len(found) < whole / 3


def test_histograms_say_their_range(recording: Recording):
    speeds, gap, change = histogram_figure([recording, recording]).axes
    median = float(np.median(recording.table["speed"].to_numpy()))
    assert speeds.get_title("left").startswith(f"median {median:.2f}, 98 % from")
    assert sum(bar.get_height() for bar in speeds.patches) == pytest.approx(2 * len(recording.table), rel=0.01)
    assert gap.get_xlabel() == "gap to the vehicle ahead [m]"
    assert change.get_xlim()[0] < 0 < change.get_xlim()[1]


@pytest.mark.parametrize("factor", [1.0, 0.0123, -0.987], ids=["as recorded", "gentle", "reversed"])
def test_no_title_of_a_histogram_is_cut_off(recording: Recording, factor: float, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(recording_figures, "accelerations", lambda _: factor * np.linspace(-0.734, 0.624, 1001))
    figure = histogram_figure([recording])
    figure.canvas.draw()
    for axes in figure.axes:
        assert axes._left_title.get_window_extent().x1 <= figure.bbox.width
        assert "-" not in axes.get_title("left")


def test_lone_vehicles_have_no_gaps(recording: Recording):
    one = recording.table.filter(recording.table["vehicle"] == recording.table["vehicle"][0])
    figure = histogram_figure([replace(recording, table=one)])
    assert figure.axes[1].get_title("left") == "none"
