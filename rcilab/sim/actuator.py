"""The control laws that turn a reference into the setpoint of the drives, once a cycle.

    POSITION              the servo follows the commanded angles, also for a stop and at standstill
    JOINT_IMPEDANCE       springs at the joints act towards the commanded angles
    CARTESIAN_IMPEDANCE   springs at the tool act towards the commanded pose, and the desired wrench is
                          added; both along the force axes, at the tool's origin
    TORQUE                the commanded torques act, gravity and friction are compensated; where a maker has no bound
                          of commands, larger ones than the arm's torque act as that
    GUIDE                 the arm is weightless and is guided by hand
    BRAKED                the brakes hold

With the virtual guide enabled and an active safety box, walls push the tool back into the box while the arm is
compliant (both impedance laws and hand guiding), with the stiffness of the Cartesian impedance. The box is then not
checked.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.model.robot_model import RobotModel
from rcilab.sim.arm_parameters import UPRIGHT, ArmParameters
from rcilab.sim.compliance import ModalDamping
from rcilab.sim.force_frame import ForceAxes
from rcilab.sim.hand_guiding import FREE, GuidedFreedom, guide_torque, wall_torque
from rcilab.sim.impedance_control import cartesian_impedance, joint_impedance
from rcilab.sim.plant import Drive, Measurement, Setpoint
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.tool_kinematics import ToolKinematics

# Per cycle: the largest wrench, 60 N and 30 N m, is reached after 0.5 s. A tuning value.
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

    def __init__(self, name: str) -> None:
        self.is_compliant: Final = name not in ("position", "braked")
        """Whether the arm may deviate from its reference, so that a stop begins at the measured position."""
        self.drive: Final = _DRIVES.get(name, Drive.TORQUE)
        """Mode of the drives."""
        self.is_force_driven: Final = name in ("torque", "guide")
        """Whether forces move the arm, and commanded angles follow the measured ones."""


class Actuator:
    """Computes setpoints. Owned by the virtual arm.

    Args:
        model: The arm with its tool and load.
        parameters: The configuration from the client.
    """

    def __init__(self, model: RobotModel, parameters: ArmParameters) -> None:
        self._axes = ForceAxes(model, parameters)
        self._wrench = (0.0,) * 6  # The present desired wrench.
        self.configure(model, parameters)
        self._freedom = FREE
        self._q3_held = 0.0

    def configure(self, model: RobotModel, parameters: ArmParameters) -> None:
        """Sets new parameters, and the model with their tool and load."""
        self._law = ControlLaw.BRAKED
        self._damper = ModalDamping()
        self._axes.configure(model, parameters)
        self._model = model
        self._parameters = parameters
        self._soft_limits = parameters.soft_limits(model.limits.joint)
        self._largest_torque: list[float] = model.limits.joint.torque.tolist()

    def begin_guiding(self, freedom: GuidedFreedom, measured: Measurement) -> None:
        """Begins hand guiding; the directions that are not free are held at the present pose."""
        self._freedom = freedom
        self._T_held = self._model.forward(measured.q)
        self._q3_held = float(measured.q[2])

    def setpoint(
        self,
        law: ControlLaw,
        commanded: ReferenceTrajectory,
        tool_c: ToolKinematics,
        measured: Measurement,
        tau: list[float] | None,
    ) -> Setpoint:
        """Returns the setpoint of this cycle.

        Args:
            law: The control law.
            commanded: The reference of the joints.
            tool_c: The reference of the tool, already updated.
            measured: The measurement.
            tau: Commanded torques, n plain floats, [N m], for TORQUE; None: none yet.
        """
        if law is not self._law:
            self._law, self._damper = law, ModalDamping()
            self._axes.begin()
        if law is not ControlLaw.CARTESIAN_IMPEDANCE:
            self._wrench = (0.0,) * 6
        if not law.is_compliant:
            return Setpoint(law.drive, commanded.q, commanded.dq, commanded.ddq, None, commanded.arrays)
        if law is ControlLaw.TORQUE:
            largest = self._largest_torque
            torque = [0.0] * len(largest) if tau is None else [min(max(x, -y), y) for x, y in zip(tau, largest)]  # noqa: B905
        else:
            torque = self._compliance(law, commanded, tool_c, measured)
            box = self._parameters.guiding_box
            if box is not None:
                torque = torque + wall_torque(self._model, measured, box, self._parameters.cartesian_stiffness)
        return Setpoint(law.drive, commanded.q, commanded.dq, commanded.ddq, torque)

    def _compliance(
        self, law: ControlLaw, commanded: ReferenceTrajectory, tool_c: ToolKinematics, measured: Measurement
    ) -> JointVector:
        model, parameters = self._model, self._parameters
        if law is ControlLaw.JOINT_IMPEDANCE:
            return joint_impedance(model, *commanded.arrays, measured, parameters.joint_stiffness, self._damper)
        if law is ControlLaw.CARTESIAN_IMPEDANCE:
            tool = model.rigid_body.tool_terms(measured.q, measured.dq)
            self._axes.follow(tool_c.twist[:3], tool)
            self._wrench = _approach(self._wrench, parameters.desired_wrench)
            return cartesian_impedance(
                model,
                tool_c.pose,
                tool_c.twist,
                tool_c.acceleration,
                commanded.arrays,
                measured,
                parameters.cartesian_stiffness,
                self._wrench,
                axes=None if self._axes.is_world else np.array(self._axes.rotation(tool.pose)).reshape(3, 3),
                damper=self._damper,
            )
        damping = parameters.guide_damping
        torque = guide_torque(model, measured, self._freedom, self._T_held, self._soft_limits, self._q3_held, damping)
        if parameters.gravity == UPRIGHT:
            return torque
        body, q = model.rigid_body, measured.q
        return torque + body.tilted_gravity(q, parameters.gravity) - body.gravity(q)


def _approach(wrench: tuple[float, ...], desired: tuple[float, ...]) -> tuple[float, ...]:
    """Returns the next wrench on a ramp to the desired one: a step would accelerate the arm suddenly."""
    if wrench == desired:
        return desired
    return tuple(
        now + min(max(goal - now, -step), step) for now, goal, step in zip(wrench, desired, _WRENCH_STEP, strict=True)
    )
