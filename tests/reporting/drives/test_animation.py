"""Videos have the right frames, play in real time, and are complete or absent."""

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from PIL import Image, ImageSequence
from report_fakes import COMES, LEAVES, LOST, STEPS, make_lost, make_stray, make_trace

from coverdrive.errors import SettingError
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.progress import heard_by
from coverdrive.reporting.drives.animation import animate
from coverdrive.reporting.drives.reasons import Reason
from coverdrive.reporting.plotting import style
from coverdrive.simulation.drives.outcome import Kind

pytestmark = pytest.mark.usefixtures("no_global_change")

HELD = 10
"""frames in which the last moment is held: 1 s at 10 frames per second"""


def frames_of(path) -> np.ndarray:
    """All frames, at half the size."""
    with av.open(path) as video:
        frames = [frame.to_ndarray(width=800, height=352, format="rgb24") for frame in video.decode(video=0)]
    return np.array(frames)


@pytest.fixture(scope="module")
def video(tmp_path_factory) -> tuple[Path, list[tuple[str, float]]]:
    """A video in a folder of its own, and what was told while it was written."""
    told = []
    path = tmp_path_factory.mktemp("video") / "new" / "drive.mp4"
    with heard_by(lambda stage, share: told.append((stage, share))):
        animate(make_trace(kind=Kind.SIDE), path)
    return path, told


def test_one_frame_for_every_moment_in_real_time(video):
    path, told = video
    frames = len(frames_of(path))
    with av.open(path) as content:
        assert content.duration / av.time_base == pytest.approx(frames * 0.1, abs=0.05)
    assert frames == STEPS + 1 + HELD
    assert {stage for stage, _ in told} == {"video"}
    shares = [share for _, share in told]
    assert shares[1:-1] == pytest.approx(np.arange(1, frames + 1) / frames)
    assert shares[0] == 0 and shares[-1] == 1
    assert [file.name for file in path.parent.iterdir()] == ["drive.mp4"]


def test_players_understand_the_format(video):
    path, _ = video
    with av.open(path) as content:
        (stream,) = content.streams
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.average_rate) == (1600, 704, 10)
    written = path.read_bytes()
    assert written.index(b"moov") < written.index(b"mdat")  # it plays before all of it is there


def test_frames_show_the_drive(video):
    frames = frames_of(video[0]).astype(np.int16)
    blue = (frames[..., 2] - frames[..., 0] > 100).sum(axis=(1, 2))
    assert (blue > 100).all()  # the ego is in every frame
    change = np.abs(np.diff(frames, axis=0)).max(axis=(1, 2, 3))
    assert (change[:STEPS] > 100).all()  # it moves in every step,
    assert (change[STEPS + 1 :] < 60).all()  # and stands still at the end
    vermilion = (frames[..., 0] - frames[..., 2] > 120).sum(axis=(1, 2))
    assert (vermilion > 100).all()
    light = ((frames[..., 0] > 230) & (np.ptp(frames, axis=-1) > 15)).sum(axis=(1, 2))
    assert light[-1] > 0.8 * light[STEPS - 1]  # the last moment has the sets of the step before


@pytest.mark.slow
def test_vehicles_that_left_their_sets_are_framed_from_then_on(tmp_path):
    animate(make_stray(), tmp_path / "drive.mp4")
    road = frames_of(tmp_path / "drive.mp4")[:, 70:120]
    dark = (road.max(-1) < 60).sum(axis=(1, 2))
    assert dark[LEAVES : STEPS + 1].min() > dark[COMES:LEAVES].max() + 20


@pytest.mark.slow
def test_the_worst_moment_is_named_for_a_second(tmp_path, monkeypatch):
    said, write = [], Text.set_text
    monkeypatch.setattr(Text, "set_text", lambda text, words: (said.append(str(words)), write(text, words))[1])
    animate(make_lost(), tmp_path / "drive.mp4")
    titles = [words for words in said if " s, ego " in words]
    assert [", clear plan lost 0.9 s" in title for title in titles] == [moment >= LOST for moment in range(len(titles))]
    assert titles[-1].endswith(": side collision")


def test_no_reason_is_cut_off_or_covered(tmp_path, monkeypatch):
    why = "would meet 21 of 360 predicted paths, hardest that of the vehicle ahead partly in the same lane, in 2.9 s, "
    why += "at 12.3 m/s and would get 0.04 m off the road"
    places, draw = [], Text.draw

    def drawn(text, renderer):
        draw(text, renderer)
        if text.get_text().endswith("off the road"):
            place, legends = text.get_window_extent(renderer), text.figure.legends
            places.append((place.x1 < text.figure.bbox.x1, place.y1 < legends[0].get_window_extent(renderer).y0))

    monkeypatch.setattr(Text, "draw", drawn)
    monkeypatch.setattr("coverdrive.reporting.drives.animation.reason_of", lambda trace, step: Reason(why))
    animate(make_trace(2), tmp_path / "drive.gif")
    assert places and all(map(all, places))


def test_a_failure_leaves_no_file(trace, tmp_path):
    def fail(stage, share):
        if share > 0.3:
            raise RuntimeError("stop")

    with heard_by(fail), pytest.raises(RuntimeError, match="stop"):
        animate(trace, tmp_path / "drive.mp4")
    assert list(tmp_path.iterdir()) == []


def test_other_formats_are_refused(trace, tmp_path):
    with pytest.raises(SettingError, match=r"\.gif"):
        animate(trace, tmp_path / "drive.avi")


def test_gif_plays_in_real_time_with_the_colours_of_the_figures(tmp_path):
    animate(make_trace(4), tmp_path / "drive.gif", problem=ProblemSettings())
    with Image.open(tmp_path / "drive.gif") as gif:
        frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(gif)]
        seconds = sum(frame.info["duration"] for frame in ImageSequence.Iterator(gif)) / 1000
        assert gif.info["loop"] == 0
    assert seconds == pytest.approx((4 + 1 + HELD) * 0.1)
    for colour in (style.EGO, style.OTHER):
        near = np.abs(np.array(frames) - (255 * np.array(to_rgb(colour)))).max(-1) < 8
        assert near.any(axis=(1, 2)).all()


def test_a_gif_whose_frames_are_no_hundredths_of_a_second_plays_in_real_time(tmp_path):
    trace, period = make_trace(4), 0.125
    animate(replace(trace, time=period * np.arange(5)), tmp_path / "drive.gif")
    with Image.open(tmp_path / "drive.gif") as gif:
        seconds = sum(frame.info["duration"] for frame in ImageSequence.Iterator(gif)) / 1000
    assert seconds == pytest.approx((4 + 1 + 8) * period, abs=0.006)  # 8 of them held
