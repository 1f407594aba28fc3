"""Segments and the traffic around them go in; out come affordances, labels, and a trained network (paper §2.2 to §3.1).

Door: `affordance`. The rest is for prediction alone.
"""
