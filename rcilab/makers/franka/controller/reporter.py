"""The reported state: the neutral one of every maker, for records and displays, and the numbers of Franka's datagram.

Desired values (`_d`) are those of the reference, which the controller follows; commanded ones (`_c`) are the same: no
filter lies between them that this arm would not follow. While torques move the arm, both are the measured ones.

* The elbow is the angle of joint 3, and +1 where joint 4 is above the angle at which the arm is stretched, -1 below.
* External torques and forces have the sign of libfranka's robot_state.h: those that the arm exerts on its environment
  are positive. The wrench is at the origin of the stiffness frame K, in axes of the base (`O_F_ext_hat_K`) or of K
  (`K_F_ext_hat_K`). In rcilab's own state they are those that the environment exerts on the arm.
* Near a singularity the wrench is zero: `SINGULAR`.
* A contact disappears with its force, a collision with the error recovery.
* The drives have no elasticity: theta is q, dtheta is dq.
* tau_J has gravity; tau_J_d and commanded torques have not: the controller compensates it. While an impedance moves the
  arm, tau_J_d are its torques.
* The acceleration sensors, two at each joint but the last, read those of a stationary arm: the reaction to gravity, in
  the axes of Craig's frame of the joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointVector, make_readonly, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.i18n.translator import Remark
from rcilab.makers.franka.collisions import CollisionThresholds, describe_collisions
from rcilab.makers.franka.controller.settings import Settings
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.robots.arm import CRAIG
from rcilab.makers.franka.wire.state_packet import NUMBERS, SLICES
from rcilab.model.dynamics.payload import Payload
from rcilab.model.dynamics.symmetric_solver import SymmetricSolver
from rcilab.model.robot_model import RobotModel
from rcilab.sim.contact_detector import ContactDetector, Contacts
from rcilab.sim.plant import Measurement
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.virtual_arm import CycleSignals
from rcilab.sim.wrench import wrench_at, wrench_in

GRAVITY = 9.81  # [m/s^2]
SINGULAR = 0.01
"""Smallest singular value of the Jacobian, in metres and radians, at which a Cartesian motion begins and forces on the
tool are reported; rcilab's own choice."""
_SINGULAR_SQUARE = SINGULAR**2 * np.eye(6)
_JOINT_4 = 3  # From 0.
_TWISTS = tuple((cos(row.alpha), sin(row.alpha)) for row in CRAIG[:6])  # Of the joints with a sensor.
_O_T_EE, _O_T_EE_D = SLICES["O_T_EE"], SLICES["O_T_EE_d"]
_FROM_ELBOW = slice(SLICES["elbow"].start, NUMBERS)  # These numbers are written at once, in the order of `FIELDS`.
_ELBOWS, _MOTION = slice(0, 4), slice(4, None)


class StateReporter:
    """Builds the state of each cycle. Owned by the controller.

    Attributes:
        numbers: Those of the last state's datagram, see `FIELDS`, shape (284,).

    Args:
        model: The arm with its tool and load.
        settings: The client's settings.
    """

    def __init__(self, model: RobotModel, settings: Settings) -> None:
        flip = model.description.elbow_flip
        assert flip is not None  # Every Franka arm has one.
        self._flip = flip
        self.numbers: NDArray[np.float64] = np.zeros(NUMBERS)
        self._zeros = readonly_copy(np.zeros(model.n))
        self._zeros6 = readonly_copy(np.zeros(6))
        self._tau_d = self._zeros
        self._q = self._zeros
        self._contacts = ContactDetector(settings.thresholds)
        self._solver = SymmetricSolver(6)
        self.configure(model, settings)

    def configure(self, model: RobotModel, settings: Settings) -> None:
        """Sets new frames, loads or thresholds; only at standstill."""
        self._model, self._settings = model, settings
        self._contacts.configure(settings.thresholds)
        self._shown: Contacts | None = None
        self._flags = np.zeros(0)  # Those of `_shown` as numbers.
        self._lever = settings.EE_T_K
        numbers = self.numbers
        for name, pose in (
            ("F_T_EE", settings.T_flange_tool),
            ("EE_T_K", settings.EE_T_K),
            ("F_T_NE", settings.F_T_NE),
            ("NE_T_EE", settings.NE_T_EE),
        ):
            numbers[SLICES[name]] = columns_of(pose)
        _write_body(numbers, "m_ee", "I_ee", "F_x_Cee", settings.end_effector)
        _write_body(numbers, "m_load", "I_load", "F_x_Cload", settings.client_load)
        self._signals: CycleSignals | None = None

    def report(
        self,
        message_id: int,
        signals: CycleSignals,
        tau_drives: Sequence[float] | Array | None,
        *,
        faults: tuple[FrankaError, ...],
        success_rate: float,
        motion_generator_mode: MotionGeneratorMode,
        controller_mode: ControllerMode,
        robot_mode: RobotMode,
    ) -> RobotState:
        """Returns the state of this cycle, and updates the numbers of its datagram.

        Args:
            message_id: Number of the state.
            signals: Those of the cycle.
            tau_drives: Torques of a control law without gravity, n numbers, [N m]; None: the servos hold the arm.
            faults: The errors that are set.
            success_rate: Share of commands in time.
            motion_generator_mode: Of the motion.
            controller_mode: Of the motion.
            robot_mode: Of the phase.
        """
        if any(signals.wrench.tolist()) and self._is_singular(signals.measured):
            signals = signals._replace(wrench=self._zeros6)
        commanded, tool_c, measured, tool, tau_commanded, _, wrench = signals
        q_c, dq_c, ddq_c = commanded.arrays
        if tau_commanded is None:
            tau_d = self._model.rigid_body.shared_torque(q_c, dq_c, ddq_c)
        else:
            tau_d = readonly_copy(tau_commanded)
        dtau = (tau_d - self._tau_d) / CYCLE_TIME if self._signals is not None else self._zeros
        self._tau_d = tau_d
        rates = make_readonly(np.array([*tool_c.twist, *tool_c.acceleration]))
        self._write(signals, rates, tau_drives)
        self._signals, self._q = signals, measured.q
        return build_state(
            (
                message_id,
                measured.q,
                q_c,
                measured.dq,
                dq_c,
                ddq_c,
                ReportedPose(tool.matrix),
                ReportedPose(tool_c.matrix),
                rates[:6],
                rates[6:],
                tool.psi,
                tool_c.psi,
                tool_c.dpsi,
                tool_c.ddpsi,
                measured.tau,
                measured.tau,
                tau_d,
                dtau,
                wrench,
                self._wrench_in_K,
                measured.q,
                measured.dq,
                measured.tau,
                measured.tau,
                faults,
                success_rate,
                motion_generator_mode,
                controller_mode,
                robot_mode,
            )
        )

    @property
    def has_collision(self) -> tuple[bool, bool]:
        """Whether an external torque, and an external force, is above its upper threshold in the last state."""
        present = self._contacts.present
        return any(present.joint_collision), any(present.cartesian_collision)

    @property
    def accelerometers(self) -> tuple[float, ...]:
        """Readings of the acceleration sensors, top then bottom, 6 joints with 3 axes each, 36 numbers, [m/s^2]."""
        x, y, z = 0.0, 0.0, GRAVITY
        readings: list[float] = []
        for q, (c, s) in zip(self._q.tolist(), _TWISTS, strict=False):
            y, z = c * y + s * z, c * z - s * y
            c, s = cos(q), sin(q)
            x, y = c * x + s * y, c * y - s * x
            readings += (x, y, z)
        return (*readings, *readings)

    def describe_collisions(self) -> Iterator[Remark]:
        """Yields each external torque and force of the last state that is above its upper threshold."""
        assert self._signals is not None  # `report` has set it.
        t, present = self._settings.thresholds, self._contacts.present
        bounds = CollisionThresholds(t.collision_torque, t.collision_force)
        if self._signals.commanded.is_accelerating:
            bounds = CollisionThresholds(t.collision_torque_accelerating, t.collision_force_accelerating)
        flags = present.joint_collision, present.cartesian_collision
        torques, wrench = -self._signals.tau_ext, -self._wrench_in_K  # With the sign that clients read.
        return describe_collisions(flags, torques.tolist(), wrench.tolist(), bounds)

    def reset_collisions(self) -> None:
        """Clears the flags of collisions, as an error recovery does."""
        self._contacts.reset()

    def _write(self, signals: CycleSignals, rates: Array, tau_drives: Sequence[float] | Array | None) -> None:
        commanded, tool_c, measured, tool, tau_c, tau_ext, wrench = signals
        q_c, dq_c, ddq_c = commanded.arrays
        q, dq, tau, last = measured.q, measured.dq, measured.tau, self._signals
        T_c = tool_c.matrix.T.ravel()
        tau_d = tau_drives if tau_c is None else tau_c
        if tau_d is None:
            tau_d = self._torque_without_gravity(commanded)
        at_K, self._wrench_in_K = self._at_stiffness_frame(tool.pose, wrench)
        self._contacts.step(tau_ext.tolist(), self._wrench_in_K.tolist(), is_accelerating=commanded.is_accelerating)
        elbow_c = tool_c.psi, self._side(float(q_c[_JOINT_4]))
        elbows = tool.psi, self._side(float(q[_JOINT_4])), *elbow_c
        if self._contacts.shown is not self._shown:
            self._shown = self._contacts.shown
            self._flags = np.fromiter(chain.from_iterable(self._shown), np.float64)
        few = np.array((*elbows, 0.0, 0.0, -GRAVITY, *elbow_c, tool_c.dpsi, 0.0, tool_c.ddpsi, 0.0))
        self.numbers[_O_T_EE] = tool.matrix.T.ravel()
        self.numbers[_O_T_EE_D] = T_c
        # External values have the other sign than in rcilab; a difference from 0.0 is not -0.0 without any.
        np.concatenate(
            (
                few[_ELBOWS], tau, tau_d, self._zeros if last is None else (tau - last.measured.tau) / CYCLE_TIME,
                q, q_c, dq, dq_c, ddq_c, self._flags, 0.0 - tau_ext, 0.0 - at_K, 0.0 - self._wrench_in_K,
                rates[:6], few[_MOTION], T_c, rates, q, dq,
            ),
            out=self.numbers[_FROM_ELBOW],
        )  # fmt: skip

    def _torque_without_gravity(self, commanded: ReferenceTrajectory) -> JointVector:
        return self._zeros if commanded.is_stationary else self._model.rigid_body.motion_torque(*commanded.arrays)

    def _is_singular(self, measured: Measurement) -> bool:
        J = self._model.rigid_body.tool_terms(measured.q, measured.dq).jacobian
        return not self._solver.is_definite(J.dot(J.T) - _SINGULAR_SQUARE)

    def _at_stiffness_frame(self, T_base_tool: Pose, wrench: Array) -> tuple[Array, Array]:
        """Returns a wrench on the end effector (base axes, its origin) at the origin of K, in base and in K axes."""
        if not any(wrench.tolist()):
            return self._zeros6, self._zeros6
        T_base_K = T_base_tool @ self._lever
        at_K = wrench_at(wrench, T_base_tool.parts[1], T_base_K.parts[1])
        return at_K, wrench_in(at_K, T_base_K.parts[0])

    def _side(self, q4: float) -> float:
        return 1.0 if q4 > self._flip else -1.0


def columns_of(pose: Pose) -> tuple[float, ...]:
    """Returns the 16 numbers of a pose, column-major."""
    return tuple(pose.matrix.T.ravel().tolist())


def _write_body(numbers: NDArray[np.float64], mass: str, inertia: str, center: str, body: Payload) -> None:
    numbers[SLICES[mass]] = body.mass
    numbers[SLICES[inertia]] = body.inertia.ravel()
    numbers[SLICES[center]] = body.center_of_mass
