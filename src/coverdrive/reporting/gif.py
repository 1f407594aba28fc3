"""Frames as a GIF with one palette for all of them: the colours of `coverdrive.reporting.style` and their blends.

A palette made from the frames would miss what is rare, and one for every frame would flicker.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from matplotlib.colors import to_rgb
from PIL import Image

from coverdrive.reporting import style

WIDTH = 1200
"""[pixel]"""

_SHADES = 8
"""from one colour to another"""


def write_gif(path: Path, frames: Iterable[UInt8[np.ndarray, "height width 4"]], rate: float) -> None:
    """Write frames, RGBA pixels of at least one, as a GIF that plays for ever, so many per second."""
    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette().ravel().tolist())
    pictures = (_small(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first = next(pictures)
    first.save(
        path, format="GIF", save_all=True, append_images=pictures, duration=round(1000 / rate), loop=0, optimize=False
    )


def _small(frame: UInt8[np.ndarray, "height width 4"]) -> Image.Image:
    picture = Image.fromarray(np.asarray(frame)).convert("RGB")
    return picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)


def _palette() -> UInt8[np.ndarray, "_ 3"]:
    """All colours that a frame is drawn with, blended into what they are drawn on."""
    sets = [style.SETS(age)[:3] for age in np.linspace(0, 1, 24)]
    inks = (
        style.EGO,
        style.OTHER,
        style.GREEN,
        style.ORANGE,
        style.PURPLE,
        style.BAD,
        style.BLACK,
        style.GREY,
    )
    blends = [(ink, "white") for ink in inks]
    blends += [(style.TIMES(age)[:3], style.SETS(age)[:3]) for age in (0.33, 0.67, 1.0)]
    blends += [(ink, sets[8]) for ink in (style.EGO, style.OTHER, style.MARKING, "white")]
    blends += [(ink, style.ROAD) for ink in (style.EGO, style.OTHER, style.MARKING)]
    share = np.linspace(0, 1, _SHADES)[:, None]
    shades = [share * to_rgb(above) + (1 - share) * to_rgb(below) for above, below in blends]
    colours = np.concatenate([np.array(sets), *shades])
    return np.unique((255 * colours).round().astype(np.uint8), axis=0)
