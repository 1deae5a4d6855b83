"""The ideal plant: it is exactly at its setpoint, and torques move it by the rigid-body model.

    POSITION   q = q_c; with the joint torques tau = M ddq_c + C dq_c + g - J^T w
    TORQUE     M ddq + C dq + g = tau_c + g_model + J^T w, integrated over 1 ms; no limit of torque, and no friction
               or rotors but those of the description, which the measured torques, at the links, lack
    BRAKED     stops at once, with any external force

w is the external wrench (`push`). g_model is the gravity of the controller's model, g that of the physical load
(`mount`); they differ if a wrong load is configured. This plant has no obstacles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, make_readonly, readonly_copy, scalar
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.dynamics.rigid_body import RigidBody
from rcilab.model.robot_model import RobotModel
from rcilab.sim.plant import Drive, Measurement, Setpoint
from rcilab.sim.push import Push

_REMEDY = "use plant='mujoco' (in a shell: rcilab controller --plant mujoco)"
_CYCLE, _HALF = scalar(CYCLE_TIME), scalar(CYCLE_TIME / 2.0)  # [s]


class IdealPlant:
    """An arm that follows its setpoints exactly.

    Args:
        model: The arm with its tool and load.
    """

    kind = "ideal"

    def __init__(self, model: RobotModel) -> None:
        self._zeros = readonly_copy(np.zeros(model.n))
        self._model = model
        self._mounted: Payload | None = None
        self._body = model.rigid_body
        self._moved = self._with_rotors()
        self._push = Push(model, np.zeros(6))
        self.reset(model.home)

    def configure(self, model: RobotModel) -> None:
        """Sets a new tool or load; the arm keeps its position, at standstill."""
        self._model = model
        self._push = self._push.on(model)
        self.mount(self._mounted)

    def mount(self, load: Payload | None) -> None:
        """Attaches a physical payload to the flange; None: that of setLoad."""
        self._mounted = load
        model = self._model
        self._body = model.rigid_body if load is None else RigidBody(model.description, load, model.T_flange_tool)
        self._moved = self._with_rotors()
        self._is_stationary = False

    def _with_rotors(self) -> RigidBody:
        """Returns the body that torques move: with the rotor inertia that the drives do not compensate."""
        model, load = self._model, self._mounted
        if load is None:
            return model.driven_body
        return RigidBody(model.description, load, model.T_flange_tool, rotor_inertia=model.description.rotor_inertia)

    def reset(self, q: JointVector) -> Measurement:
        """Places the arm at `q`, shape (n,), [rad], at standstill."""
        return self._stop_at(readonly_copy(q))

    def push(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Applies an external force until the next call; see `Plant.push`."""
        self._push = Push(self._model, wrench, link, point)
        self._is_stationary = False

    def place_box(self, name: str, size: ArrayLike, pose: Pose) -> None:
        """Refuses: this plant does not simulate contact."""
        self.require_contact(f"box {name!r}")

    def remove_box(self, name: str) -> None:
        """Refuses: this plant does not simulate contact."""
        raise UsageError(f"box {name!r}: the ideal plant does not simulate contact and has no boxes; {_REMEDY}").coded(
            "no_contact"
        )

    def find_overlap(self, q: JointVector) -> str | None:
        """Returns None: there are no boxes."""

    def set_floor(self, on: bool) -> None:
        """Refuses a floor."""
        if on:
            self.require_contact("floor")

    def require_contact(self, what: str) -> None:
        """Refuses: this plant does not simulate contact."""
        raise UsageError(f"{what}: the ideal plant does not simulate contact; {_REMEDY}").coded("no_contact")

    def set_walls(self, box: SafetyBox | None) -> None:
        """Refuses walls."""
        if box is not None:
            self.require_contact("walls")

    def step(self, setpoint: Setpoint) -> Measurement:
        """Advances by one cycle."""
        last = self._measurement
        if setpoint.drive is Drive.TORQUE:
            return self._move_by_torque(self._zeros if setpoint.tau is None else np.asarray(setpoint.tau))
        if setpoint.drive is Drive.BRAKED:
            if self._is_stationary:
                return last
            if not last.dq.any():
                return self._stop_at(last.q)
            return self._measure(last.q, self._zeros, last.dq / -CYCLE_TIME)  # The torque of an immediate stop.
        stays = not any(setpoint.dq) and not any(setpoint.ddq) and last.q.tolist() == list(setpoint.q)
        if stays:
            return last if self._is_stationary else self._stop_at(last.q)
        return self._measure(*setpoint.as_arrays())

    def _stop_at(self, q: JointVector) -> Measurement:
        measurement = self._measure(q, self._zeros, self._zeros)
        self._is_stationary = True
        return measurement

    def _measure(self, q: JointVector, dq: JointVector, ddq: JointVector) -> Measurement:
        tau = self._body.shared_torque(q, dq, ddq)
        if self._push.is_active:
            tau = make_readonly(tau - self._push.torque(q))
        self._is_stationary = False
        self._measurement = Measurement(q, dq, tau)
        return self._measurement

    def _move_by_torque(self, tau_c: JointVector) -> Measurement:
        """Moves the arm by torques.

        Accelerations are evaluated in the middle of the millisecond, so that a free swing keeps its energy; q advances
        by the new velocity, so that measured velocities are the backward differences of measured angles.
        """
        q, dq = self._measurement.q, self._measurement.dq
        external = self._push.torque(q) if self._push.is_active else None
        tau = tau_c if external is None else tau_c + external
        damping = self._model.description.damping
        if damping is not None:
            tau = tau - damping * dq
        accelerate = self._moved.weightless_acceleration if self._mounted is None else self._acceleration
        ddq = accelerate(q, dq, tau)
        ddq = accelerate(q + _HALF * dq, dq + _HALF * ddq, tau)
        dq = dq + _CYCLE * ddq
        q = q + _CYCLE * dq
        self._is_stationary = False
        tau_links = tau_c + self._model.rigid_body.gravity(q)
        if damping is not None:
            tau_links -= damping * dq
        rotors = self._model.description.rotor_inertia
        if rotors is not None:
            tau_links -= rotors * ddq
        self._measurement = Measurement(make_readonly(q), make_readonly(dq), make_readonly(tau_links))
        return self._measurement

    def _acceleration(self, q: JointVector, dq: JointVector, tau: JointVector) -> JointVector:
        """Returns the acceleration with a load that differs from the controller's gravity compensation."""
        return self._moved.acceleration(q, dq, tau + self._model.rigid_body.gravity(q))
