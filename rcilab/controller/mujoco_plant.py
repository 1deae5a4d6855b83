"""The arm as MuJoCo moves it: torques, inertia, friction, and drives that follow a setpoint as well as they can.

Each millisecond is one `mj_step`. The drives know the rigid-body model and most of the friction:

    POSITION   tau = M (ddq_c + K_d (dq_c - dq) + K_p (q_c - q)) + C dq + g + friction       computed torque
    IMPEDANCE  tau = K (q_c - q) + D (dq_c - dq) + M ddq_c + C dq + g + friction             a spring at each joint
    TORQUE     tau = tau_c + C dq + g + friction
    GUIDED     tau = g + C dq + friction - a little damping                                   hand guiding
    BRAKED     the brakes take the speed out within some 0.1 s, then the arm is rigid

What a drive adds to gravity, Coriolis and friction compensation is limited. The manual's torque figure is that of a
torque command, and a drive must be able to do more: with the rated load, gravity of the stretched arm alone exceeds it,
and the manual's accelerations need up to 3.9 times of it. Self-contact is left out: the controller judges positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.arrays import Array, JointVector, as_vector, frozen
from rcilab.controller.plant import Drive, Measurement, Setpoint
from rcilab.model import RobotModel
from rcilab.robots.mjcf import ARMATURE_PER_TORQUE, DAMPING_PER_TORQUE, TIMESTEP, build_mjcf

BANDWIDTH = 80.0  # [rad/s] of the position servo, critically damped; a choice, about 13 Hz
KP, KD = BANDWIDTH**2, 2.0 * BANDWIDTH  # [1/s^2], [1/s]
IMPEDANCE_DAMPING = 0.7  # of critical, at the inertia the joint has just now; a choice
FRICTION_KNOWN = 0.9  # Share of the friction that the drives compensate; no drive knows it exactly.
GUIDED_DAMPING = 0.05  # [N m s/rad per N m of torque limit] lets a guided arm come to rest; a choice
PEAK_TORQUE = 4.0  # Times the manual's torque limit, what a drive adds at most; a choice, see above
BRAKE_TIME = 0.02  # [s] time constant of the brakes; a choice

_BRAKES_HOLD = 1e-4  # [rad/s] below this closed brakes hold
_STILL_SPEED = 1e-7  # [rad/s] below this a resting arm is said to rest
_STILL_ERROR = 1e-9  # [rad] farther than this from its setpoint an arm still creeps


class MuJoCoPlant:
    """An arm with mass, friction and limited torque.

    Args:
        model: The arm with its tool and load.
    """

    kind = "mujoco"
    drives = frozenset(Drive)

    def __init__(self, model: RobotModel) -> None:
        self._zeros = frozen(np.zeros(model.n))
        self._push = np.zeros(6)
        self._build(model)
        self._measurement = self.reset(model.home)

    def configure(self, model: RobotModel) -> None:
        """Takes a new tool or load; the arm stays where it is, at rest."""
        q = self._measurement.q
        self._build(model)
        self.reset(q)

    def reset(self, q: JointVector) -> Measurement:
        """Puts the arm at `q`, shape (n,), [rad], at rest."""
        self._mj.mj_resetData(self._model, self._data)
        self._q[:] = q
        self._mj.mj_step1(self._model, self._data)
        self._rests = True
        self._rest_q: Sequence[float] = np.asarray(q).tolist()
        self._tau = self._bias.copy()
        return self._measure()

    def push(self, wrench: ArrayLike) -> None:
        """Lets something outside press on the tool until told otherwise.

        Args:
            wrench: Force and moment on the tool at its origin, base axes, shape (6,), [N, N m].

        Raises:
            InvalidValueError: Not six finite numbers.
        """
        self._push = as_vector(wrench, 6, "wrench", "N, N m")
        self._rests = False

    def step(self, setpoint: Setpoint) -> Measurement:
        """Lives through one millisecond with torques that try to be at the setpoint at its end."""
        if self._rests and self._keeps_resting(setpoint):
            return self._measurement
        self._rests = False
        mj, model, data = self._mj, self._model, self._data
        mj.mj_step1(model, data)
        drive_torque = self._drive_torque(setpoint)
        np.clip(drive_torque, -self._peak, self._peak, out=drive_torque)
        motor = drive_torque + self._bias + FRICTION_KNOWN * self._friction * self._dq
        loss = self._friction * self._dq
        self._applied[:] = motor
        if setpoint.drive is not Drive.BRAKED and self._push.any():
            self._applied += self._outside_torque()
        mj.mj_step2(model, data)
        self._tau = motor - loss - self._armature * self._ddq
        self._settle(setpoint)
        return self._measure()

    def _drive_torque(self, setpoint: Setpoint) -> Array:
        """Returns what the drives add to gravity, Coriolis and friction compensation, shape (n,), [N m]."""
        q, dq = self._q, self._dq
        if setpoint.drive is Drive.TORQUE:
            return np.array(setpoint.tau if setpoint.tau is not None else self._zeros)
        if setpoint.drive is Drive.GUIDED:
            return -GUIDED_DAMPING * self._torque_limit * dq
        if setpoint.drive is Drive.BRAKED:
            return self._times_inertia(dq * (-1.0 / BRAKE_TIME))
        # The setpoint is where the arm is to be at the end of this millisecond; q and dq are those of its beginning.
        ddq_c = np.array(setpoint.ddq)
        dq_c = np.array(setpoint.dq)
        error = np.array(setpoint.q) - TIMESTEP * dq_c - q
        speed_error = dq_c - TIMESTEP * ddq_c - dq
        if setpoint.drive is Drive.IMPEDANCE and setpoint.stiffness is not None:
            stiffness = np.array(setpoint.stiffness)
            damping = 2.0 * IMPEDANCE_DAMPING * np.sqrt(stiffness * self._own_inertia())
            return stiffness * error + damping * speed_error + self._times_inertia(ddq_c)
        return self._times_inertia(ddq_c + KD * speed_error + KP * error)

    def _settle(self, setpoint: Setpoint) -> None:
        """Lets an arm that has come to rest be at rest: its last 1e-7 rad/s would otherwise never end."""
        if setpoint.drive is Drive.BRAKED:
            if np.abs(self._dq).max() < _BRAKES_HOLD:
                self._come_to_rest(self._q.tolist())
        elif setpoint.drive is Drive.POSITION and not any(setpoint.dq) and not any(setpoint.ddq):
            if self._push.any() or np.abs(self._dq).max() > _STILL_SPEED:
                return
            if np.abs(self._q - setpoint.q).max() < _STILL_ERROR:
                self._come_to_rest(list(setpoint.q))

    def _come_to_rest(self, q: Sequence[float]) -> None:
        self._dq[:] = 0.0
        self._mj.mj_step1(self._model, self._data)
        self._tau = self._bias.copy()
        self._rests = True
        self._rest_q = q

    def _keeps_resting(self, setpoint: Setpoint) -> bool:
        if setpoint.drive is Drive.BRAKED:
            return True
        stays = setpoint.drive is Drive.POSITION and not any(setpoint.dq) and not any(setpoint.ddq)
        return stays and list(setpoint.q) == self._rest_q

    def _measure(self) -> Measurement:
        tau_ext, wrench = self._zeros, self._no_wrench
        if not self._rests and self._push.any():  # The joints hold against what presses on the tool.
            tau_ext, wrench = frozen(-self._outside_torque()), frozen(-self._push)
        self._measurement = Measurement(frozen(self._q), frozen(self._dq), frozen(self._tau + tau_ext), tau_ext, wrench)
        return self._measurement

    def _outside_torque(self) -> Array:
        """Returns the joint torques of the push on the tool, shape (n,), [N m]: transposed Jacobian times wrench."""
        self._mj.mj_jacSite(self._model, self._data, self._J[:3], self._J[3:], self._tool)
        return self._J.T @ self._push

    def _times_inertia(self, ddq: Array) -> Array:
        self._mj.mj_mulM(self._model, self._data, self._product, ddq)
        return self._product.copy()

    def _own_inertia(self) -> Array:
        """Returns the diagonal of the mass matrix, shape (n,), [kg m^2]."""
        return np.array([self._times_inertia(row)[i] for i, row in enumerate(self._unit)])

    def _build(self, model: RobotModel) -> None:
        import mujoco  # pyright: ignore[reportMissingTypeStubs]

        mj: Any = mujoco
        text = build_mjcf(model.description, T_flange_tool=model.T_flange_tool, load=model.load)
        self._mj, self._model = mj, mj.MjModel.from_xml_string(text)
        self._model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT
        self._data: Any = mj.MjData(self._model)
        self._tool: int = self._model.site("tool").id
        self._q: Array = self._data.qpos  # These are windows into MuJoCo's memory, not copies.
        self._dq: Array = self._data.qvel
        self._ddq: Array = self._data.qacc
        self._bias: Array = self._data.qfrc_bias
        self._applied: Array = self._data.qfrc_applied
        self._torque_limit = np.array(model.limits.joint.torque)
        self._peak = PEAK_TORQUE * self._torque_limit
        self._armature = ARMATURE_PER_TORQUE * self._torque_limit
        self._friction = DAMPING_PER_TORQUE * self._torque_limit
        self._product = np.zeros(model.n)
        self._unit = np.eye(model.n)
        self._J = np.zeros((6, model.n))
        self._no_wrench = frozen(np.zeros(6))
