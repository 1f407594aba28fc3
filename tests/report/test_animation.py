"""Videos have the right frames, play in real time, and are complete or absent."""

import subprocess

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image, ImageSequence
from report_fakes import COMES, LEAVES, STEPS, make_stray, make_trace

from coverdrive.errors import SettingError
from coverdrive.planning.obstacles import ObstacleSettings
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.report import style
from coverdrive.report.animation import animate
from coverdrive.report.binding import Binding
from coverdrive.simulation.outcome import Kind

pytestmark = pytest.mark.usefixtures("no_global_change")

HELD = 10
"""frames in which the last moment is held: 1 s at 10 frames per second"""


def frames_of(path) -> np.ndarray:
    """All frames, at half the size."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-vf", "scale=800:304"]
    command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    pixels = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(pixels, np.uint8).reshape(-1, 304, 800, 3)


def test_one_frame_for_every_moment_in_real_time(trace, tmp_path):
    shares = []
    path = tmp_path / "new" / "drive.mp4"
    animate(trace, path, shares.append)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert frames == STEPS + 1 + HELD
    assert seconds == pytest.approx(frames * 0.1, abs=0.05)
    assert shares == pytest.approx(np.arange(1, frames + 1) / frames)
    assert [file.name for file in path.parent.iterdir()] == ["drive.mp4"]


def test_players_understand_the_format(trace, tmp_path):
    animate(trace, tmp_path / "drive.mp4")
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "drive.mp4")]
    about = subprocess.run(command, capture_output=True, text=True, check=False).stderr
    assert "Video: h264" in about
    assert "yuv420p" in about
    assert "1600x608" in about
    assert "10 fps" in about


def test_frames_show_the_drive(tmp_path):
    animate(make_trace(kind=Kind.SIDE), tmp_path / "drive.mp4")
    frames = frames_of(tmp_path / "drive.mp4").astype(np.int16)
    blue = (frames[..., 2] - frames[..., 0] > 100).sum(axis=(1, 2))
    assert (blue > 100).all()  # the own car is in every frame
    change = np.abs(np.diff(frames, axis=0)).max(axis=(1, 2, 3))
    assert (change[:STEPS] > 100).all()  # it moves in every step,
    assert (change[STEPS + 1 :] < 60).all()  # and stands still at the end
    vermilion = (frames[..., 0] - frames[..., 2] > 120).sum(axis=(1, 2))
    assert (vermilion > 100).all()
    light = ((frames[..., 0] > 230) & (np.ptp(frames, axis=-1) > 15)).sum(axis=(1, 2))
    assert light[-1] > 0.8 * light[STEPS - 1]  # the last moment has the sets of the step before


def test_vehicles_that_left_their_sets_are_framed_from_then_on(tmp_path):
    animate(make_stray(), tmp_path / "drive.mp4")
    road = frames_of(tmp_path / "drive.mp4")[:, 70:120]
    dark = (road.max(-1) < 60).sum(axis=(1, 2))
    assert dark[LEAVES : STEPS + 1].min() > dark[COMES:LEAVES].max() + 20


def test_a_failure_leaves_no_file(trace, tmp_path):
    def fail(share):
        raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        animate(trace, tmp_path / "drive.mp4", fail)
    assert list(tmp_path.iterdir()) == []


def test_other_formats_are_refused(trace, tmp_path):
    with pytest.raises(SettingError, match=r"\.gif"):
        animate(trace, tmp_path / "drive.avi")


def test_gif_plays_in_real_time_with_the_colours_of_the_figures(trace, tmp_path):
    animate(trace, tmp_path / "drive.gif", binding=Binding(VehicleSettings(), ObstacleSettings()))
    with Image.open(tmp_path / "drive.gif") as gif:
        frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(gif)]
        seconds = sum(frame.info["duration"] for frame in ImageSequence.Iterator(gif)) / 1000
        assert gif.info["loop"] == 0
    assert seconds == pytest.approx((STEPS + 1 + HELD) * 0.1)
    for colour in (style.OWN, style.OTHER):
        near = np.abs(np.array(frames) - (255 * np.array(to_rgb(colour)))).max(-1) < 8
        assert near.any(axis=(1, 2)).all()
