"""Puts in order what commonroad-io reads, but would take in another way than it is written.

Whoever looks at a scenario afterwards, as the drivability checker does, sees the same.
"""

from copy import copy
from itertools import pairwise
from typing import Any

from commonroad.common.util import AngleInterval
from commonroad.planning.goal import GoalRegion
from commonroad.scenario.trajectory import Trajectory

from coverdrive.errors import DataError
from coverdrive.recordings.files.scenario import has_sets, sets_of

_WIDEST = 3.0
"""[rad] commonroad-io tells angles apart that differ by less than half a turn"""


def in_order(scenario: Any) -> None:
    """Sort the states of all obstacles by their time steps: commonroad-io counts them as they are listed."""
    for obstacle in scenario.dynamic_obstacles:
        if hasattr(obstacle.prediction, "trajectory"):
            states = sorted(obstacle.prediction.trajectory.state_list, key=lambda state: state.time_step)
            obstacle.prediction.trajectory = Trajectory(states[0].time_step, states)


def refuse_unknown(scenario: Any) -> None:
    """Refuse obstacles of which it is not known where they are at every time step from their first to their last.

    Raises:
        DataError: there is one; the message names it.
    """
    for obstacle in scenario.dynamic_obstacles:
        name, first = f"obstacle {obstacle.obstacle_id}", obstacle.initial_state.time_step
        if obstacle.prediction is None:
            continue
        if has_sets(obstacle):
            known = [step for step, _ in sets_of(obstacle)]
            steps = sorted(step for step in known if isinstance(step, int))
            if len(steps) < len(known):
                problem = f"{name} has sets of places for intervals of time"
                raise DataError(f"{problem}; expected one for each time step, give it these")
        else:
            steps = [state.time_step for state in obstacle.prediction.trajectory.state_list]
        for before, after in pairwise([first, *steps[steps[:1] == [first] :]]):
            if after > before + 1:
                problem = f"{name} has no state at time step {before + 1}, but at {after}"
                raise DataError(f"{problem}; expected one at every time step, give it those that are missing")
            if after <= before:
                raise DataError(f"{name} has a state too many at time step {after}; expected one, remove the other")


def with_narrow_headings(goal: GoalRegion) -> GoalRegion:
    """The same goal in more states, where headings reach wider [rad] than commonroad-io can tell.

    Three parts of half the width stand for one, so that each heading is well inside of one of them, or at an end.
    """
    states = [each for state in goal.state_list for each in _narrow(state)]
    return goal if len(states) == len(goal.state_list) else GoalRegion(states)


def _narrow(state: Any) -> list[Any]:
    if not state.has_value("orientation"):
        return [state]
    width = state.orientation.end - state.orientation.start
    if width <= _WIDEST:
        return [state]
    parts = [copy(state) for _ in range(3)]
    for part, begin in zip(parts, (0.0, 0.25, 0.5), strict=True):
        start = state.orientation.start + begin * width
        part.orientation = AngleInterval(start, min(start + width / 2, state.orientation.end))
    return parts
