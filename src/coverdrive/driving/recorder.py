"""The recorder: what a driver saw and planned, as a trace: for measures, page and replay of any simulator's drives."""

from collections.abc import Hashable, Mapping, Sequence

import jax
import numpy as np

from coverdrive.driving.driver import Command, Driver
from coverdrive.driving.goal import Goal
from coverdrive.driving.perception import Numbers, Told
from coverdrive.errors import DataError
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.trace import Decision, Step, Trace, make_trace
from coverdrive.simulation.traffic.model import TrafficStep


class Recorder:
    """Stands between a driver and its world, and remembers one drive."""

    def __init__(self, driver: Driver):
        """Listen to a driver from now on; use the recorder's `reset` and `step` instead of the driver's."""
        self.driver = driver
        self._forget()

    def reset(self) -> None:
        """`Driver.reset`; what was recorded is forgotten as well."""
        self.driver.reset()
        self._forget()

    def _forget(self) -> None:
        self._commands, self._roads, self._end = list[Command](), list[Road](), list[Scene]()

    def step(self, own: Numbers, others: Mapping[Hashable, Told], road: Road, goal: Goal | None = None) -> Command:
        """`Driver.step`, remembered; a DataError if the road has become another one."""
        if self._end:
            raise DataError("this drive has been ended; reset the recorder before the next one")
        if self._roads and not road.same(self._roads[0]):
            raise DataError("the road is another one than at the first step; a trace is a drive on one road")
        command = self.driver.step(own, others, road, goal)
        self._commands.append(command)
        self._roads.append(road)
        return command

    def end(self, own: Numbers, others: Mapping[Hashable, Told]) -> None:
        """Tell the drive's last moment, one period after the last step, as of `Driver.step`.

        Without it, the trace ends when the last step begins.
        """
        if not self._commands or self._end:
            raise DataError("a drive ends once, after at least one step; reset the recorder before the next one")
        self._end.append(self.driver.see(own, others, self._roads[0]))

    def trace(self) -> Trace:
        """The drive up to now or to the ego's first contact; vehicles are where they were seen, in the slots of then.

        Raises:
            DataError: no step has been completed.
        """
        seen = [*(command.scene for command in self._commands), *self._end]
        made = [
            Decision(each.prediction, each.plan, each.prediction_seconds, each.planning_seconds, each.wall_seconds)
            for each in self._commands
        ]
        if len(seen) < 2:
            raise DataError("there is no drive yet; a trace needs two moments at least")
        return trace_of(seen, made, self._roads[0], self.driver.period)


def trace_of(seen: Sequence[Scene], decisions: Sequence[Decision], road: Road, period: float) -> Trace:
    """Two or more moments, ``period`` [s] apart, and what the ego made of all but the last, up to the first contact.

    A vehicle keeps its slot; later scenes may have more of them.
    """
    slots = seen[-1].vehicles
    scenes = [jax.tree.map(lambda each, more=slots - scene.vehicles: np.pad(each, (0, more)), scene) for scene in seen]
    steps, collision = list[Step](), None
    for moment, (decision, scene) in enumerate(zip(decisions, scenes[1:], strict=False), start=1):
        steps.append(Step(decision, TrafficStep.without_bases(scene)))
        collision = collision_at(moment, scenes, period, road)
        if collision is not None:
            break
    return make_trace(scenes[0], road, steps, period, collision)
