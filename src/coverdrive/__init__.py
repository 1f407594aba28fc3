"""Certified manoeuvre sets from recorded highway traffic, and motion planning against every member of them.

Everything lives in the sub-packages, which read from top to bottom as the data flow: ``recordings`` →
``prediction`` and ``certificates`` → ``planning`` → ``simulation`` → ``report``. Importing this package loads none
of them.

Source of the method: Chen, Rosolia, Fan, Ames, Murray, "Reactive motion planning with probabilistic safety
guarantees", CoRL 2020.
"""

__version__ = "0.1.0"
