"""The environment as pictures: the road from above around the ego, and the predicted sets if there are any."""

from importlib import import_module

import numpy as np
from jaxtyping import Float, UInt8

from coverdrive.errors import MissingExtraError, SettingError
from coverdrive.extras import EXTRAS
from coverdrive.geometry import CORNERS, body_corners
from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.road_markings import dashes, markings
from coverdrive.scene import Scene
from coverdrive.simulation.roads.initial import EGO

_SIZE, _SCALE, _BEHIND = (1200, 240), 8.0, 40.0
"""[pixel] width and height of a picture, [pixel/m], and [m] of road behind the ego"""
_PAPER, _ROAD, _MARKING, _SETS, _EGO, _OTHER = "white", "#EFEFEF", "#A0A0A0", "#F8C79F", "#0072B2", "#D55E00"


class View:
    """Draws scenes, in a window if one is wanted."""

    def __init__(self, window: bool, period: float):
        """Open a window that shows a picture every ``period`` [s], if there is to be one.

        Raises:
            MissingExtraError: pygame is not installed.
            SettingError: no window can be opened.
        """
        try:
            self._pygame = import_module("pygame")
        except ImportError as error:
            raise MissingExtraError(
                f"render_mode needs pygame; install it with `{EXTRAS['gymnasium'].command}`"
            ) from error
        self._period, self._shown = period, None
        self._pygame.font.init()
        self._font = self._pygame.font.Font(None, 24)
        self._picture = self._pygame.Surface(_SIZE)
        if window:
            try:
                self._pygame.display.init()
                self._shown = self._pygame.display.set_mode(_SIZE)
            except self._pygame.error as error:
                raise SettingError(f'no window can be opened here ({error}); use render_mode="rgb_array"') from error
            self._pygame.display.set_caption("coverdrive")
            self._clock = self._pygame.time.Clock()

    def __reduce__(self) -> tuple[type["View"], tuple[bool, float]]:
        """A copy, as in another process, draws for itself, and has no window."""
        return View, (False, self._period)

    def show(self, scene: Scene, road: Road, paths: PredictedPaths | None, said: str) -> None:
        """Show a scene in the window, and wait until it is time."""
        if self._shown is None:
            return
        self._draw(scene, road, paths, said)
        self._shown.blit(self._picture, (0, 0))
        self._pygame.event.pump()
        self._pygame.display.flip()
        self._clock.tick(1 / self._period)

    def pixels(
        self, scene: Scene, road: Road, paths: PredictedPaths | None, said: str
    ) -> UInt8[np.ndarray, "height width 3"]:
        """The picture of a scene."""
        self._draw(scene, road, paths, said)
        return np.ascontiguousarray(self._pygame.surfarray.array3d(self._picture).swapaxes(0, 1))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._shown is not None:
            self._pygame.display.quit()
            self._shown = None

    def _draw(self, scene: Scene, road: Road, paths: PredictedPaths | None, said: str) -> None:
        draw, picture = self._pygame.draw, self._picture
        first = float(scene.lon[EGO]) - _BEHIND
        last = first + _SIZE[0] / _SCALE
        middle = (float(road.edges[0]) + float(road.edges[-1])) / 2

        def at(points: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
            return (points - [first, middle]) * [_SCALE, -_SCALE] + [0.0, _SIZE[1] / 2]

        picture.fill(_PAPER)
        sides = [at(line.points) for line in markings(road, first, last) if line.outer]
        draw.polygon(picture, _ROAD, np.concatenate([sides[0], sides[1][::-1]]).tolist())
        for boxes in () if paths is None else at(paths.points[:, :, None] + CORNERS * paths.half_sizes[:, :, None]):
            for box in boxes.tolist():
                draw.polygon(picture, _SETS, box)
        for side in sides:
            draw.lines(picture, _MARKING, False, side.tolist(), 2)
        for dash in at(dashes(road, first, last)).tolist():
            draw.line(picture, _MARKING, *dash, 2)
        for slot, body in enumerate(at(body_corners(scene.states, scene.half_sizes)).tolist()):
            if scene.valid[slot]:
                draw.polygon(picture, _EGO if slot == EGO else _OTHER, body)
        picture.blit(self._font.render(said, True, "black"), (8, 8))
