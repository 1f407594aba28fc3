"""Driving the planner in closed loop among uncontrolled vehicles, once or many times (paper §5)."""
