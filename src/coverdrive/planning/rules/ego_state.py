"""Which measured state of the ego is believed, and what is taken for true where it is not."""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.road import Road

_FARTHEST = 1e9
"""[m] no road is longer"""
_BESIDE = 5.0
"""[m] beyond the edge of the road where the ego may be"""
_BACKWARDS = 1.0
"""[m/s] at which it may roll backwards"""
_ASTRAY = np.array([5.0, 1.5, 5.0, 0.3])
"""lon [m], lat [m], speed [m/s], heading [rad] by which the ego may be off its plan after `_PERIOD`"""
_PERIOD = 0.25
"""[s] after which; more than usual between two plans"""


def plausible(state: Float[np.ndarray, " 4"], vehicle: VehicleSettings, road: Road) -> Bool[np.ndarray, " 4"]:
    """Which measured values can be true: finite, and not beyond what a car on this road can have.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        vehicle: limits of the ego; up to twice its largest speed is believed.
        road: the lanes.
    """
    least = np.array([-_FARTHEST, road.edges[0] - _BESIDE, -_BACKWARDS, -np.pi / 2])
    largest = np.array([_FARTHEST, road.edges[-1] + _BESIDE, 2 * vehicle.max_speed, np.pi / 2])
    return (state >= least) & (state <= largest)


def continued(state: Float[np.ndarray, " 4"], expected: Float[np.ndarray, " 4"], period: float) -> bool:
    """Whether the ego can have come to a state, rather than to the one that its last plan leads to.

    Within 0.25 s full braking (8 m/s²) where full throttle (3 m/s²) was planned makes 2.8 m/s and 0.3 m. All that tyres
    give to one side (8 m/s²) where as much to the other was planned makes 0.5 m; steering one way where the other way
    was planned makes 0.2 rad, at 10 m/s. For noise the limits leave 2 m/s, 1 m across the road and 0.1 rad even then;
    along the road they allow for a call that comes 0.1 s late at 45 m/s. They grow with longer periods.

    Args:
        state: measured: lon [m], lat [m], speed [m/s], heading [rad].
        expected: where the last plan leads to by now.
        period: [s] since the last plan.
    """
    return bool((np.abs(state - expected) <= _ASTRAY * max(1.0, period / _PERIOD)).all())


def assumed_state(
    measured: Float[np.ndarray, " 4"], believed: Bool[np.ndarray, " 4"], vehicle: VehicleSettings, road: Road
) -> Float[np.ndarray, " 4"]:
    """What is assumed of a state of which not everything can be true, where nothing is known from before.

    Args:
        measured: the state.
        believed: which of its values can be true.
        vehicle: limits of the ego.
        road: the lanes.

    Returns:
        The state, with the middle of the road, the largest speed and the road's direction for what cannot be true.
    """
    middle = float(road.edges[0] + road.edges[-1]) / 2
    return np.where(believed, measured, np.array([0.0, middle, vehicle.max_speed, 0.0]))
