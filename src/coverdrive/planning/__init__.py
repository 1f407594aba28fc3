"""The ego's state and predicted paths go in; out comes the plan for the next three seconds (paper §4).

`planner` applies the rules, makes the surroundings, and lets the solver search, which asks the check. Door: `planner`.
"""
