"""The command for which a virtual controller stopped a recorded motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rcilab.conformance.common_conditions import condition_table
from rcilab.conformance.refusal import with_refusal
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import FaultCode, name_faults
from rcilab.recording.playout import played_commands

if TYPE_CHECKING:
    from rcilab.conformance.report import Report
    from rcilab.core.condition import Condition
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run import Run

_REACH = 20  # [cycles] How long after one without a command the next ones depend on it.
_NOT_COMMANDED = ("external_torque", "external_force", "link_distance", "lost_commands")
"""Signals of the arm itself and the network."""


def angles_of_refused(run: Run, q: JointVector) -> JointVector | None:
    """Returns the joint angles to which a refused velocity leads in one cycle, shape (n,), [rad]; None without one.

    Of a goal that is not finite, these are the numbers of the goal.

    Args:
        run: A run with `PLAYOUT_FIELDS`, of velocities or goals.
        q: The last commanded joint angles before, shape (n,), [rad].
    """
    cycles = run.cycles
    played, sources = played_commands(cycles)
    faulty = np.flatnonzero(cycles["faults"])[:1]
    command = cycles[sources[np.isin(played, faulty)]]
    if not len(command):
        return None
    dq, twist, goal = (command[name][0] for name in ("command_dq", "command_twist", "command_goal"))
    if np.isfinite(cycles["command_goal"]).any():
        return None if np.isfinite(goal).all() else goal
    if np.isfinite(cycles["command_dq"]).any():
        return q + CYCLE_TIME * dq
    if run.model is None or not np.isfinite(twist).all():
        return None
    return _moved(run.model, q, CYCLE_TIME * twist)


def explain_stop(report: Report, run: Run, model: RobotModel) -> Report:
    """Returns a report with the violation for which the controller stopped the motion, if commands are to blame.

    It is the violation as the controller reported it. Where cycles without a command come shortly before, it has a note
    instead: the controller decides over how many cycles the next command leads.

    Args:
        report: A report that is ok.
        run: A run with `PLAYOUT_FIELDS`.
        model: The arm.
    """
    table = condition_table(model.description)
    blamed = {fault: rows for fault in run.faults if (rows := _commanded(table.raising(fault)))}
    if not blamed:
        return report
    faulty = int(np.flatnonzero(run.cycles["faults"])[0])
    missed = run.cycles["missed"][: faulty + 1]
    if missed[-_REACH:].any():
        return replace(report, motion=replace(report.motion, notes=(*report.motion.notes, _note(run, blamed, missed))))
    known = {row.id for row in report.rows}
    for fault, rows in reversed(blamed.items()):
        condition = next((row for row in rows if row.id in known), rows[0])
        reported = str(run.stopped or fault.manual_name)
        report = with_refusal(report, condition, model.limits, report.motion.duration, reported=reported)
    return report


def _commanded(rows: tuple[Condition, ...]) -> tuple[Condition, ...]:
    """Returns the conditions on commands that raise a fault; none if measured values raise it, too."""
    return () if any(row.is_measured or row.signal in _NOT_COMMANDED for row in rows) else rows


def _note(run: Run, blamed: dict[FaultCode, tuple[Condition, ...]], missed: Array) -> str:
    count = int(missed.sum())
    return (
        f"the controller stopped it for {name_faults(blamed)}, but its commands conform in the client's own order: it "
        f"had counted {count} cycle{'s' * (count != 1)} without a command, and decides when the next one comes over "
        "how many cycles that leads"
    )


def _moved(model: RobotModel, q: JointVector, step: Array) -> JointVector:
    """Returns the joint angles after a small step of the tool, base axes, [m, rad], with the least motion of joints."""
    half = q + np.linalg.pinv(model.jacobian(q)) @ (step / 2.0)
    return q + np.linalg.pinv(model.jacobian(half)) @ step
