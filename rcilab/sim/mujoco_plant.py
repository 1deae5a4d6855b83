"""The MuJoCo plant: torques, inertia, friction, contact, and drives with limited torque.

Each millisecond is one `mj_step`. The drives apply to the joints:

    POSITION   M (ddq_c + K_d (dq_c - dq) + K_p (q_c - q)) + C dq + g + friction  computed torque
    TORQUE     tau_c + g_model + friction                               for M ddq + C dq = tau_c + J^T w
    BRAKED     the brakes stop the arm within about 0.1 s and hold external forces; then the arm is rigid

w is the external wrench. The position servo uses the physical load, like one with integral action in steady state;
TORQUE compensates the gravity of the load from setLoad (`g_model`). The drives compensate 90 % of the friction, or all
of it where the description has the damping that commanded torques meet. In TORQUE a joint torque loop compensates the
inertia of the rotors, so that the commanded torque acts at the output of the gear; in POSITION the rotors are
accelerated with the links.

The torque of a drive in addition to the compensation is limited. The manual's torque limit is that of a torque command;
a drive needs more: with the rated load, gravity of the stretched arm alone exceeds it, and the manual's accelerations
need up to 3.9 times that limit. Self-collision is not simulated: the controller checks positions.

With the imperfections of real joints, Coulomb friction acts in TORQUE, where nothing compensates it, and the torque
sensors have noise and steps. In POSITION the servo rejects friction, like one with integral action; it is in the torque
readings alone.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell
from rcilab.core.arrays import Array, JointVector, make_readonly, scalar
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel
from rcilab.robots.description import JointImperfection
from rcilab.robots.mjcf import ARMATURE_PER_TORQUE, DAMPING_PER_TORQUE, TIMESTEP, build_mjcf
from rcilab.sim.mujoco_obstacles import Obstacles
from rcilab.sim.plant import Drive, Measurement, Setpoint
from rcilab.sim.push import Push
from rcilab.sim.torque_sensors import TorqueSensors

BANDWIDTH = 80.0  # [rad/s] of the position servo, critically damped, about 13 Hz; a tuning value
KP, KD = BANDWIDTH**2, 2.0 * BANDWIDTH  # [1/s^2], [1/s]
FRICTION_KNOWN = 0.9  # Share of the friction that the drives compensate; that of real drives is not known exactly.
PEAK_TORQUE = 4.0  # Largest torque of a drive, in units of the manual's torque limit; see above
END_STOP = math.radians(10.0)  # [rad] of the end stops beyond the manual's joint range: room to stop in
BRAKE_TIME = 0.02  # [s] time constant of the brakes; a tuning value

_KP, _KD, _STEP = scalar(KP), scalar(KD), scalar(TIMESTEP)
_BACK, _AHEAD = scalar(KP * TIMESTEP), scalar(1.0 - KD * TIMESTEP)  # [1/s], [1]
_STICTION = (0.999, 0.9999)  # Impedance of MuJoCo's friction constraint: at its default a stuck joint creeps.
_BRAKED_SPEED = 1e-4  # [rad/s] Below this, engaged brakes hold the arm.
_STILL_SPEED = 1e-7  # [rad/s] Below this, a joint counts as stationary.
_STILL_ERROR = 1e-9  # [rad] A stationary joint nearer to its setpoint counts as being there.
_STILL_CYCLES = 100  # Cycles of standstill until an arm off its setpoint counts as stationary.

_log = logging.getLogger("rcilab.sim")


class MuJoCoPlant:
    """An arm with mass, friction, limited torque and contact with obstacles.

    Args:
        model: The arm with its tool and load.
        friction: Scale of the viscous joint friction; 0: none.
        imperfections: Coulomb friction and torque sensors of the joints, n of them; None: neither.
        cell: What the arm carries and what stands around it, which are solid; None: neither.
    """

    kind = "mujoco"

    def __init__(
        self,
        model: RobotModel,
        *,
        friction: float = 1.0,
        imperfections: Sequence[JointImperfection] | None = None,
        cell: Cell | None = None,
    ) -> None:
        self._friction_scale = friction
        self._coulomb = None if imperfections is None else np.array([joint.friction for joint in imperfections])
        self._sensors = None if imperfections is None else TorqueSensors(imperfections)
        self._mounted: Payload | None = None
        self._obstacles = Obstacles(cell)
        self._build(model)
        self._push = Push(model, np.zeros(6))
        self._measurement = self.reset(model.home)

    def configure(self, model: RobotModel) -> None:
        """Sets a new tool or load; the arm keeps its position, at standstill."""
        q = self._measurement.q
        self._build(model)
        self._push = self._push.on(model)
        self.reset(q)

    def mount(self, load: Payload | None) -> None:
        """Attaches a physical payload to the flange; None: that of setLoad."""
        q, dq = self._q.copy(), self._dq.copy()
        self._mounted = load
        self._build(self._robot)
        self._q[:], self._dq[:] = q, dq
        self._mj.mj_step1(self._model, self._data)
        self._is_stationary = False

    def reset(self, q: JointVector) -> Measurement:
        """Places the arm at `q`, shape (n,), [rad], at standstill."""
        self._mj.mj_resetData(self._model, self._data)
        return self._set_standstill(np.asarray(q).tolist())

    def push(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Applies an external force until the next call; see `Plant.push`."""
        self._push = Push(self._robot, wrench, link, point)
        self._is_stationary = False

    def place_box(self, name: str, size: ArrayLike, pose: Pose) -> None:
        """Adds or moves a solid box; see `Plant.place_box`."""
        self._obstacles.place_box(name, size, pose, self._data)
        self._is_stationary = False

    def remove_box(self, name: str) -> None:
        """Removes a box; see `Plant.remove_box`."""
        self._obstacles.remove_box(name)
        self._is_stationary = False

    def find_overlap(self, q: JointVector) -> str | None:
        """Returns which link would overlap what is solid with the arm at `q`; see `Plant.find_overlap`."""
        before = self._q.copy()
        self._q[:] = q
        try:
            return self._obstacles.find_overlap(self._data)
        finally:
            self._q[:] = before
            self._mj.mj_kinematics(self._model, self._data)

    def set_floor(self, on: bool) -> None:
        """Adds or removes a solid floor; see `Plant.set_floor`."""
        self._obstacles.set_floor(on)
        self._is_stationary = False

    def require_contact(self, what: str) -> None:
        """Does nothing: this plant simulates contact."""

    def set_walls(self, box: SafetyBox | None) -> None:
        """Makes the faces of a safety box solid walls for the links; None removes them."""
        self._obstacles.set_walls(box)
        self._is_stationary = False

    def step(self, setpoint: Setpoint) -> Measurement:
        """Advances by one cycle with torques towards the setpoint at its end."""
        measured = self._step(setpoint)
        if self._sensors is None:
            return measured
        return self._sensors.read(measured, is_friction_simulated=setpoint.drive is Drive.TORQUE)

    def _step(self, setpoint: Setpoint) -> Measurement:
        if self._is_stationary and self._remains_stationary(setpoint):
            return self._measurement
        self._is_stationary = False
        mj, model, data = self._mj, self._model, self._data
        self._set_rotor_inertia(setpoint.drive is not Drive.TORQUE)
        dq, bias = self._dq.copy(), self._bias.copy()
        drive_torque = self._drive_torque(setpoint)
        np.minimum(drive_torque, self._peak, out=drive_torque)  # np.clip takes three times as long as both together.
        np.maximum(drive_torque, self._trough, out=drive_torque)
        compensated = self._robot.rigid_body.gravity(self._q) if setpoint.drive is Drive.TORQUE else bias
        motor = drive_torque + compensated + self._known_friction * dq
        self._applied[:] = motor
        if self._push.is_active:
            self._applied += self._push_torque()
        mj.mj_step2(model, data)
        mj.mj_step1(model, data)  # Forces and contacts at the new position.
        # The motor torque less rotor inertia and friction, at the end of the millisecond.
        loss = self._friction * self._dq
        if self._has_rotor_inertia or not self._compensates_rotors:
            loss += self._rotors * ((self._dq - dq) / _STEP)
        self._measurement = self._measure(motor - loss + (self._bias - bias))
        self._settle(setpoint)
        return self._measurement

    def _drive_torque(self, setpoint: Setpoint) -> Array:
        """Returns the torque of the drives in addition to their compensation, shape (n,), [N m]."""
        q, dq = self._q, self._dq
        if setpoint.drive is Drive.TORQUE:
            tau = np.zeros(self._n) if setpoint.tau is None else np.array(setpoint.tau, dtype=np.float64)
            return tau if self._damping is None else tau - self._damping * dq
        if setpoint.drive is Drive.BRAKED:
            return self._times_inertia(dq * (-1.0 / BRAKE_TIME)) - self._push_torque()
        # The setpoint is for the end of this millisecond; q and dq are those of its beginning:
        # ddq_c + KD (dq_c - h ddq_c - dq) + KP (q_c - h dq_c - q), rearranged.
        q_c, dq_c, ddq_c = setpoint.as_arrays()
        return self._times_inertia(_KP * (q_c - q) + _KD * (dq_c - dq) - _BACK * dq_c + _AHEAD * ddq_c)

    def _push_torque(self) -> Array | float:
        """Returns the joint torques of the external force, shape (n,), [N m]; 0 without one."""
        return self._push.torque(self._q) if self._push.is_active else 0.0

    def _settle(self, setpoint: Setpoint) -> None:
        """Sets an arm that has stopped to exact standstill: its last 1e-7 rad/s would otherwise never decay."""
        speeds: list[float] = self._dq.tolist()
        speed = max(map(abs, speeds))
        if setpoint.drive is Drive.BRAKED:
            if speed < _BRAKED_SPEED:
                self._set_standstill(self._q.tolist())
            return
        if speed > _STILL_SPEED or setpoint.drive is Drive.TORQUE or any(setpoint.dq) or any(setpoint.ddq):
            self._still_for = 0
            return
        self._still_for += 1
        if not self._push.is_active and self._data.nefc == 0:  # Neither contact nor joint limit.
            if np.abs(self._q - setpoint.q).max() < _STILL_ERROR:
                self._set_standstill(list(setpoint.q))
        elif self._still_for > _STILL_CYCLES:
            self._dq[:] = 0.0
            self._measurement = self._measure(self._measurement.tau)
            self._is_stationary, self._stationary_q = True, list(setpoint.q)

    def _set_standstill(self, q: Sequence[float]) -> Measurement:
        self._q[:] = q
        self._dq[:] = 0.0
        self._mj.mj_step1(self._model, self._data)
        self._measurement = self._measure(self._bias - self._push_torque())
        self._is_stationary, self._stationary_q = True, q
        return self._measurement

    def _remains_stationary(self, setpoint: Setpoint) -> bool:
        if setpoint.drive is Drive.BRAKED:
            return True
        stays = setpoint.drive is Drive.POSITION and not any(setpoint.dq) and not any(setpoint.ddq)
        return stays and list(setpoint.q) == self._stationary_q

    def _measure(self, tau: Array) -> Measurement:
        n, rows = self._n, make_readonly(np.concatenate((self._q, self._dq, tau)))  # One copy for all three.
        return Measurement(rows[:n], rows[n : 2 * n], rows[2 * n :])

    def _set_rotor_inertia(self, on: bool) -> None:
        if on is not self._has_rotor_inertia:
            self._has_rotor_inertia = on
            self._armature[:] = 0.0 if self._compensates_rotors and not on else self._rotors
            if self._coulomb is not None:
                self._model.dof_frictionloss[:] = 0.0 if on else self._coulomb
            self._mj.mj_step1(self._model, self._data)

    def _times_inertia(self, ddq: Array) -> Array:
        self._mj.mj_mulM(self._model, self._data, self._product, ddq)
        return self._product.copy()

    def _build(self, model: RobotModel) -> None:
        import mujoco  # pyright: ignore[reportMissingTypeStubs]

        mj: Any = mujoco
        mj.set_mju_user_warning(_log_warning)  # Otherwise MuJoCo writes a file into the user's directory.
        load = model.load if self._mounted is None else self._mounted
        text = build_mjcf(
            model.description,
            T_flange_tool=model.T_flange_tool,
            load=load,
            mounted=model.mounted,
            surroundings=self._obstacles.surroundings(model),
        )
        spec: Any = mj.MjSpec.from_string(text)
        self._obstacles.add_to(spec, mj, model)
        self._mj, self._robot, self._n = mj, model, model.n
        self._model: Any = spec.compile()
        self._obstacles.install(self._model, mj)
        self._model.dof_damping *= self._friction_scale
        self._model.dof_solimp[:, :2] = _STICTION
        self._model.jnt_range[: self._n] += [-END_STOP, END_STOP]
        self._data: Any = mj.MjData(self._model)
        self._q: Array = self._data.qpos  # Views of MuJoCo's memory, not copies.
        self._dq: Array = self._data.qvel
        self._bias: Array = self._data.qfrc_bias
        self._applied: Array = self._data.qfrc_applied
        self._armature: Array = self._model.dof_armature
        torque = model.limits.joint.torque
        self._peak: Array = PEAK_TORQUE * torque
        self._trough = -self._peak
        rotors = model.description.rotor_inertia
        self._compensates_rotors = rotors is None
        self._damping = model.description.damping
        self._rotors: Array = ARMATURE_PER_TORQUE * torque if rotors is None else np.array(rotors)
        self._friction: Array = self._friction_scale * DAMPING_PER_TORQUE * torque
        # An arm whose description has damping has no other friction.
        self._known_friction = (FRICTION_KNOWN if self._damping is None else 1.0) * self._friction
        self._product = np.zeros(model.n)
        self._has_rotor_inertia = True
        self._still_for = 0


def _log_warning(warning: str) -> None:
    """Logs a warning of MuJoCo, which reports each kind once per simulation."""
    _log.warning("MuJoCo: %s", warning)
