"""A lab for arms of ROKAE, Franka, UFACTORY and RealMan: see every limit before anything moves, then run it.

The names below are the ones a notebook needs; each is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell as Cell
    from rcilab.cell.plan_free import plan_free as plan_free
    from rcilab.conformance.check import check as check
    from rcilab.conformance.motion_monitor import Monitor as Monitor
    from rcilab.conformance.report import Report as Report
    from rcilab.control_process.simulate import simulate as simulate
    from rcilab.core.clearance import ClearanceLimit as ClearanceLimit
    from rcilab.core.command import CartesianPosition as CartesianPosition
    from rcilab.core.command import JointPosition as JointPosition
    from rcilab.core.command import JointTorque as JointTorque
    from rcilab.core.errors import RcilabError as RcilabError
    from rcilab.core.safety_box import SafetyBox as SafetyBox
    from rcilab.core.spatial import Pose as Pose
    from rcilab.execution.connect import connect as connect
    from rcilab.execution.session import RobotSession as RobotSession
    from rcilab.model.dynamics.payload import Payload as Payload
    from rcilab.model.robot_model import RobotModel as RobotModel
    from rcilab.model.robot_model import load_model as load_model
    from rcilab.motion.cartesian import plan_arc as plan_arc
    from rcilab.motion.cartesian import plan_circle as plan_circle
    from rcilab.motion.cartesian import plan_line as plan_line
    from rcilab.motion.cartesian import plan_nullspace as plan_nullspace
    from rcilab.motion.joint import plan_joint as plan_joint
    from rcilab.motion.motion import Motion as Motion
    from rcilab.motion.plan_program import plan_program as plan_program
    from rcilab.motion.program import Program as Program
    from rcilab.motion.recovery import plan_recovery as plan_recovery
    from rcilab.motion.waypoint import Waypoint as Waypoint
    from rcilab.notebook.plot import plot as plot
    from rcilab.notebook.preview import preview as preview
    from rcilab.recording.run import Run as Run
    from rcilab.recording.run import load_run as load_run

__version__ = "0.2.0"

_HOMES = {
    "Cell": "rcilab.cell.cell",
    "CartesianPosition": "rcilab.core.command",
    "JointPosition": "rcilab.core.command",
    "JointTorque": "rcilab.core.command",
    "Monitor": "rcilab.conformance.motion_monitor",
    "Motion": "rcilab.motion.motion",
    "Payload": "rcilab.model.dynamics.payload",
    "Pose": "rcilab.core.spatial",
    "Program": "rcilab.motion.program",
    "RcilabError": "rcilab.core.errors",
    "Report": "rcilab.conformance.report",
    "RobotModel": "rcilab.model.robot_model",
    "RobotSession": "rcilab.execution.session",
    "Run": "rcilab.recording.run",
    "SafetyBox": "rcilab.core.safety_box",
    "ClearanceLimit": "rcilab.core.clearance",
    "Waypoint": "rcilab.motion.waypoint",
    "plan_free": "rcilab.cell.plan_free",
    "check": "rcilab.conformance.check",
    "connect": "rcilab.execution.connect",
    "load_model": "rcilab.model.robot_model",
    "load_run": "rcilab.recording.run",
    "plan_arc": "rcilab.motion.cartesian",
    "plan_circle": "rcilab.motion.cartesian",
    "plan_joint": "rcilab.motion.joint",
    "plan_line": "rcilab.motion.cartesian",
    "plan_nullspace": "rcilab.motion.cartesian",
    "plan_program": "rcilab.motion.plan_program",
    "plan_recovery": "rcilab.motion.recovery",
    "plot": "rcilab.notebook.plot",
    "preview": "rcilab.notebook.preview",
    "simulate": "rcilab.control_process.simulate",
}

__all__ = sorted(_HOMES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    """Loads a public name on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'rcilab' has no name {name!r}; it has: {', '.join(__all__)}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
