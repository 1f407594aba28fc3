"""A road with a ramp, for tests of what sees or draws it."""

import numpy as np

from coverdrive.road import LaneEdges, Road

RAMP = Road(
    np.array([0.0, 3.5, 7.0, 10.5]),
    300.0,
    changing=LaneEdges(
        np.array([0.0, 100.0, 120.0, 200.0, 240.0]),
        np.array([[3.5, 3.5, 7, 10.5], [3.5, 3.5, 7, 10.5], [0, 3.5, 7, 10.5], [0, 3.5, 7, 10.5], [3.5, 3.5, 7, 10.5]]),
    ),
)
"""A lane on the right that comes between 100 m and 120 m and goes between 200 m and 240 m"""
