"""What the robot demands of a motion, judged before and while it moves."""

from __future__ import annotations

from rcilab.conformance.conditions import CONDITIONS, CYCLE_CONDITIONS, Condition, find_condition
from rcilab.conformance.monitor import JointMonitor

__all__ = ["CONDITIONS", "CYCLE_CONDITIONS", "Condition", "JointMonitor", "find_condition"]
