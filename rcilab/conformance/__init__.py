"""What the robot demands of a motion, judged before and while it moves."""

from __future__ import annotations

from rcilab.conformance.certificate import Certificate, verify_certificate
from rcilab.conformance.check import check
from rcilab.conformance.conditions import CONDITIONS, CYCLE_CONDITIONS, Condition, find_condition
from rcilab.conformance.monitor import JointMonitor
from rcilab.conformance.report import ConditionResult, Report, Violation
from rcilab.conformance.start import StartState

__all__ = [
    "CONDITIONS",
    "CYCLE_CONDITIONS",
    "Certificate",
    "Condition",
    "ConditionResult",
    "JointMonitor",
    "Report",
    "StartState",
    "Violation",
    "check",
    "find_condition",
    "verify_certificate",
]
