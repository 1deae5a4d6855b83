"""The five controller modes of the RCI: the pairs of modes that StartMove accepts, and the motion of each.

A pair selects what the client commands (joint angles, tool poses, torques) and the control law of the drives. Pairs
that are not in the table are refused as not possible.
"""

from __future__ import annotations

from typing import Final

from rcilab.core.state import ControllerMode
from rcilab.makers.rokae.wire import StartMotionMode
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators import CommandKind, MotionMode

C, M, K = ControllerMode, StartMotionMode, CommandKind

MODES: Final = {
    (C.JOINT_POSITION, M.JOINT): MotionMode(ControlLaw.POSITION, K.JOINT_ANGLES),
    (C.CARTESIAN_POSITION, M.CARTESIAN): MotionMode(ControlLaw.POSITION, K.POSES),
    (C.JOINT_IMPEDANCE, M.JOINT): MotionMode(ControlLaw.JOINT_IMPEDANCE, K.JOINT_ANGLES),
    (C.CARTESIAN_IMPEDANCE, M.CARTESIAN): MotionMode(ControlLaw.CARTESIAN_IMPEDANCE, K.POSES),
    (C.TORQUE, M.IDLE): MotionMode(ControlLaw.TORQUE, K.TORQUES),  # As in the vendor's example.
    (C.TORQUE, M.JOINT): MotionMode(ControlLaw.TORQUE, K.TORQUES),
}
"""Controller mode and motion mode of StartMove, and the resulting motion (manual 3.1.1)."""
