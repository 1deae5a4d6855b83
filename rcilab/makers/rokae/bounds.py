"""Bounds and defaults of arguments, for client and controller, where neither manual nor arm give them: one table.

A greater length is a mistake of units: no xMate reaches farther than 1 m from its shoulder.
"""

from __future__ import annotations

DEFAULT_PORT = 1337  # By convention of the manual (2.5); the teach pendant's RCI page shows the one in force.
FILTER_OFF = 1000.0  # [Hz] Largest cut-off frequency; there it means "no filter" (measured).
REPORT_FREQUENCY = 100.0  # [Hz] Cut-off frequency of the reported torques after the controller's start.
LOWEST_FREQUENCY = 0.1  # [Hz] Smallest cut-off frequency: a motion arrives some 20 s late. At 0 Hz nothing would pass.
LIMIT_TOLERANCE = 1e-9  # [rad] By which soft limits may exceed the arm's own: they are often converted from degrees.
LONGEST_TOOL = 2.0  # [m] From the flange to the tool, the force-control frame or the load's centre of mass.
FARTHEST_BOX = 10.0  # [m] From the base to the centre of the safety box, along each axis.
LARGEST_BOX = 100.0  # [m] Edge of the safety box.

SIGNAL_NAMES = ("0_0", "0_1", "0_2", "0_3", "1_0", "1_1")
"""Of digital outputs, after DO, and of inputs, after DI (manual 3.1.13 and 3.1.14)."""
SIGNAL_COUNT = len(SIGNAL_NAMES)
