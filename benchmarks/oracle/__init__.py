"""The planner's problem for a general solver, in CasADi: what the compiled search is checked against."""
