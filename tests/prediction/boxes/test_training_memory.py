"""Training on many windows holds few copies of them at once."""

import subprocess
import sys

import pytest

_PROGRAM = """
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from coverdrive.prediction.boxes.training import BoxSettings, train_boxes
from coverdrive.prediction.data.segments import Segments


def most():
    status = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
    return int(status["VmHWM"].split()[0]) * 1024


def trained(windows):
    random = np.random.default_rng(0)
    keys = np.arange(windows)
    sizes = np.ones((windows, 2))
    heading = np.zeros((windows, 7))
    points = random.normal(size=(windows, 7, 2))
    segments = Segments(points, sizes[:, 0], heading, sizes, 0.5, keys, keys, keys, keys)
    features = np.abs(random.normal(size=(windows, 22)).astype(np.float32))
    settings = BoxSettings(hidden=(4,), members=1, batch=2**13, most_steps=1)
    Path("/proc/self/clear_refs").write_text("5")
    begun = most()
    train_boxes(features, segments, settings, unit="share")
    return most() - begun


trained(70_000)  # what is compiled and loaded once
print(trained(1_000_000) / 1_000_000)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the peak memory of a process is read from Linux's /proc")
def test_training_takes_less_than_850_bytes_for_each_window() -> None:
    """In a process of its own: mirror images included, what is seen and wanted of a window is 368 bytes.

    What the network sees of it is 320 bytes, once; a copy of either, for JAX, would be too much. A million windows, as
    what allocators keep for threads of their own is up to 100 MB.
    """
    found = subprocess.run([sys.executable, "-c", _PROGRAM], check=True, capture_output=True, text=True)
    assert float(found.stdout) < 850
