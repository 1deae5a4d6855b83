"""What the robot demands of a motion, judged before and while it moves."""

from __future__ import annotations

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.certificate import Certificate, verify_certificate
from rcilab.conformance.check import check
from rcilab.conformance.clearance_conditions import clearance_conditions
from rcilab.conformance.clearance_monitor import ClearanceMonitor
from rcilab.conformance.condition import Condition
from rcilab.conformance.condition_tables import CONDITION_TABLES, ConditionTable, condition_table
from rcilab.conformance.conditions import CONDITIONS, CYCLE_CONDITIONS, explain_fault, find_condition
from rcilab.conformance.limit_tables import LimitTable, cartesian_limits
from rcilab.conformance.limit_violation import LimitViolation, describe_breaches
from rcilab.conformance.measured_monitor import MeasuredMonitor
from rcilab.conformance.monitor import JointMonitor
from rcilab.conformance.motion_monitor import Monitor
from rcilab.conformance.report import ConditionResult, Report, Violation
from rcilab.conformance.start import StartState
from rcilab.conformance.time_scaling import SlowDown
from rcilab.conformance.torque_monitor import TorqueMonitor

__all__ = [
    "CONDITIONS",
    "CONDITION_TABLES",
    "CYCLE_CONDITIONS",
    "BoxMonitor",
    "CartesianMonitor",
    "Certificate",
    "ClearanceMonitor",
    "Condition",
    "ConditionResult",
    "ConditionTable",
    "JointMonitor",
    "LimitTable",
    "LimitViolation",
    "MeasuredMonitor",
    "Monitor",
    "Report",
    "SlowDown",
    "StartState",
    "TorqueMonitor",
    "Violation",
    "cartesian_limits",
    "check",
    "clearance_conditions",
    "condition_table",
    "describe_breaches",
    "explain_fault",
    "find_condition",
    "verify_certificate",
]
