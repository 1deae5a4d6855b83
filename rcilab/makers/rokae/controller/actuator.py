"""What the drives are told in one cycle: the laws that turn a reference into a setpoint.

    POSITION              the servo follows the commanded angles; also how an arm comes to rest and stands still
    JOINT_IMPEDANCE       springs at the joints pull towards the commanded angles
    CARTESIAN_IMPEDANCE   springs at the tool pull towards the commanded pose, and press with the desired wrench;
                          both along the axes of setFcCoor, at the tool's origin
    TORQUE                the commanded torques act, gravity and friction are compensated
    GUIDE                 the arm is weightless and follows a hand
    BRAKED                the brakes hold

With the virtual guide on and a safety box active, walls push the tool back into the box, as stiff as the Cartesian
impedance, wherever the arm yields: under both impedances and while it is guided. The box is then not judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Final

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.force_frame import ForceAxes
from rcilab.makers.rokae.controller.hand_guiding import guide_torque, wall_torque
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.model.robot_model import RobotModel
from rcilab.sim.compliance import ModalDamping
from rcilab.sim.impedance_control import cartesian_impedance, joint_impedance
from rcilab.sim.plant import Drive, Measurement, Setpoint
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.tool_kinematics import ToolKinematics

# In a cycle: so that the largest wrench there is, 60 N and 30 N m, is reached after 0.5 s. A tuning value.
_WRENCH_STEP = (0.12,) * 3 + (0.06,) * 3
_DRIVES = {"position": Drive.POSITION, "braked": Drive.BRAKED}


class ControlLaw(Enum):
    """How a reference becomes a setpoint."""

    POSITION = "position"
    JOINT_IMPEDANCE = "joint impedance"
    CARTESIAN_IMPEDANCE = "Cartesian impedance"
    TORQUE = "torque"
    GUIDE = "guide"
    BRAKED = "braked"

    def __init__(self, words: str) -> None:
        self.yields: Final = words not in ("position", "braked")
        """Whether the arm may be elsewhere than it was told, so that a stop has to begin from where it really is."""
        self.drive: Final = _DRIVES.get(words, Drive.TORQUE)
        """What it drives the joints with."""
        self.leads: Final = words in ("torque", "guide")
        """Whether the arm goes where forces take it and commanded angles only follow."""


class Actuator:
    """Computes setpoints. Owned by the controller's cycle.

    Args:
        model: The arm with its tool and load.
        settings: What the client has set.
    """

    def __init__(self, model: RobotModel, settings: Settings) -> None:
        self._axes = ForceAxes(model, settings)
        self._wrench = (0.0,) * 6  # As it acts just now.
        self.configure(model, settings)
        self._space, self._kind = rci.DragSpace.JOINT, rci.DragType.FREE

    def configure(self, model: RobotModel, settings: Settings) -> None:
        """Takes new settings, and the model with the tool and load that they say."""
        self._law = ControlLaw.BRAKED
        self._damper = ModalDamping()
        self._axes.configure(model, settings)
        self._model = model
        self._settings = settings
        self._soft_limits = settings.soft_limits(model.limits.joint)

    def begin_guiding(self, space: rci.DragSpace, kind: rci.DragType, measured: Measurement) -> None:
        """Remembers what a hand is to leave where it is now."""
        self._space, self._kind = space, kind
        self._T_held = self._model.forward(measured.q)

    def setpoint(
        self,
        law: ControlLaw,
        commanded: ReferenceTrajectory,
        tool_c: ToolKinematics,
        measured: Measurement,
        tau: list[float] | None,
    ) -> Setpoint:
        """Returns what the drives shall do in this cycle.

        Args:
            law: How.
            commanded: The reference of the joints.
            tool_c: The same for the tool, up to date.
            measured: Where the arm is.
            tau: Commanded torques, n plain floats, [N m], for TORQUE; None is none yet.
        """
        if law is not self._law:
            self._law, self._damper = law, ModalDamping()
            self._axes.begin()
        if law is not ControlLaw.CARTESIAN_IMPEDANCE:
            self._wrench = (0.0,) * 6
        if not law.yields:
            return Setpoint(law.drive, commanded.q, commanded.dq, commanded.ddq, None, commanded.arrays)
        if law is ControlLaw.TORQUE:
            torque = [0.0] * len(commanded.q) if tau is None else tau
        else:
            torque = self._compliance(law, commanded, tool_c, measured)
            box = guiding_box(self._settings)
            if box is not None:
                torque = torque + wall_torque(self._model, measured, box, self._settings.cartesian_stiffness)
        return Setpoint(law.drive, commanded.q, commanded.dq, commanded.ddq, torque)

    def _compliance(
        self, law: ControlLaw, commanded: ReferenceTrajectory, tool_c: ToolKinematics, measured: Measurement
    ) -> JointVector:
        model, settings = self._model, self._settings
        if law is ControlLaw.JOINT_IMPEDANCE:
            return joint_impedance(model, *commanded.arrays, measured, settings.joint_stiffness, self._damper)
        if law is ControlLaw.CARTESIAN_IMPEDANCE:
            tool = model.rigid_body.tool_terms(measured.q, measured.dq)
            self._axes.follow(tool_c.twist[:3], tool.pose)
            self._wrench = _approach(self._wrench, settings.desired_wrench)
            return cartesian_impedance(
                model,
                tool_c.pose,
                tool_c.twist,
                tool_c.acceleration,
                commanded.arrays,
                measured,
                settings.cartesian_stiffness,
                self._wrench,
                axes=None if self._axes.is_world else np.array(self._axes.rotation(tool.pose)).reshape(3, 3),
                damper=self._damper,
            )
        return guide_torque(model, measured, self._space, self._kind, self._T_held, self._soft_limits)


def _approach(wrench: Sequence[float], wanted: Sequence[float]) -> tuple[float, ...]:
    """Returns a wrench a cycle later on its way to the one that is wanted: a step of it would throw the arm."""
    return tuple(
        now + min(max(goal - now, -step), step) for now, goal, step in zip(wrench, wanted, _WRENCH_STEP, strict=True)
    )


def guiding_box(settings: Settings) -> SafetyBox | None:
    """Returns the box whose walls push, or None when there are none."""
    return active_box(settings.safety_box) if settings.virtual_guide else None
