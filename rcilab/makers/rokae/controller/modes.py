"""The five controller modes of the RCI: which pairs of modes StartMove can ask for, and what each runs.

A pair selects what the client commands (joint angles, tool poses, torques) and the control law of the drives. Pairs
that are not in the table are refused as not possible.
"""

from __future__ import annotations

from typing import Final

from rcilab.core.state import ControllerMode
from rcilab.makers.rokae.wire import StartMotionMode
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators import Mode

C, M = ControllerMode, StartMotionMode

MODES: Final = {
    (C.JOINT_POSITION, M.JOINT): Mode(ControlLaw.POSITION, False),
    (C.CARTESIAN_POSITION, M.CARTESIAN): Mode(ControlLaw.POSITION, True),
    (C.JOINT_IMPEDANCE, M.JOINT): Mode(ControlLaw.JOINT_IMPEDANCE, False),
    (C.CARTESIAN_IMPEDANCE, M.CARTESIAN): Mode(ControlLaw.CARTESIAN_IMPEDANCE, True),
    (C.TORQUE, M.IDLE): Mode(ControlLaw.TORQUE, False),  # What the vendor's example asks for.
    (C.TORQUE, M.JOINT): Mode(ControlLaw.TORQUE, False),
}
"""Controller mode and motion mode of StartMove, and what they run (manual 3.1.1)."""
