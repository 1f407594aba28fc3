"""The reference planner: the planner with IPOPT in place of its descent.

It is slower than `coverdrive.planning.planner` and does not promise to be done in time; it is there to check that one
against, and as a baseline in closed loop.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.check.evaluate import Plans
from coverdrive.planning.planner import Call, MpcPlanner, PlannerSettings
from coverdrive.planning.solver.search import BEGIN, CHOOSE, GIVE_UP, NOTHING, Wanted, search
from coverdrive.planning.surroundings import Surroundings
from oracle.solvers import SolverSettings, solve


class ReferencePlanner(MpcPlanner):
    """Model predictive control with a general solver; implements `coverdrive.plan.Planner`."""

    def __init__(self, settings: PlannerSettings | None = None, options: SolverSettings | None = None):
        """Make a planner.

        Args:
            settings: of the planner; what they say about iterations and their time does not count.
            options: of the solver.
        """
        self._options = options or SolverSettings()
        super().__init__(settings)

    def _choose(
        self, call: Call, plans: Plans, wanted: Wanted, around: Surroundings, giving_up: bool,
        best: Float[np.ndarray, "L N 2"],
    ) -> tuple[int, bool]:  # fmt: skip
        """Solve the problem from every start; a start from which the solver fails stays what it is."""
        if search(BEGIN + GIVE_UP * giving_up, plans, wanted, around, call.constants)[0] == NOTHING:
            return NOTHING, False
        for i in range(wanted.guesses, wanted.guesses + 1 + len(wanted.lanes)):
            problem = self.settings.problem
            found = solve(plans.inputs[i], plans.targets[i], around, problem, self._period, self._options)
            if found is not None:
                plans.inputs[i] = found
        return search(CHOOSE, plans, wanted, around, call.constants, best=best)
