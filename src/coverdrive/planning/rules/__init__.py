"""A scene goes in; out comes what is taken for true in it, and what a plan keeps though it need not.

Door: `follower` (Remark 2), `manners` and `wish`. The rest is for the planner alone; a rule is one file.
"""
