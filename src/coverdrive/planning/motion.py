"""A car that steers to a lane."""

import numpy as np

from coverdrive.compiled import compiled

_LANE_TIME = 0.8
"""[s] in which a lane-seeking car would be back on the centre of its lane"""
_LATERAL_SPEED = 2.0
"""[m/s] at which a lane-seeking car moves sideways at the most: 3.6 m in about 2.5 s"""
_HEADING_TIME = 0.4
"""[s] in which a lane-seeking car takes the wanted heading"""


@compiled
def lane_seeking(lat: float, speed: float, heading: float, target_lat: float, hurry: float) -> float:
    """The yaw rate [rad/s] that steers to the centre of a lane.

    Args:
        lat: [m].
        speed: [m/s].
        heading: [rad].
        target_lat: [m] centre of the lane.
        hurry: how many times faster than in comfort.
    """
    fastest = hurry * _LATERAL_SPEED
    sideways = min(max((target_lat - lat) * hurry / _LANE_TIME, -fastest), fastest)
    return (np.arctan2(sideways, max(speed, 2 * fastest)) - heading) * hurry / _HEADING_TIME
