"""The requests of libfranka's `Robot` as methods: arguments are checked before they are sent.

Setters need an arm that is not moving. Frames are poses here, column-major matrices in the libraries.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array
from rcilab.core.errors import CommandRejectedError, ConnectionLostError, DeadlineError, InvalidValueError
from rcilab.core.fault import name_faults
from rcilab.core.spatial import IDENTITY, Pose, as_pose
from rcilab.core.state import RobotMode
from rcilab.makers.franka.bounds import CARTESIAN_STIFFNESS, LARGEST_JOINT_STIFFNESS, LONGEST_TOOL
from rcilab.makers.franka.collisions import CollisionThresholds
from rcilab.makers.franka.driver.client import ANSWER_TIMEOUT, FciClient, columns_of
from rcilab.makers.franka.driver.state_reader import errors_of
from rcilab.makers.setting_values import bounded_vector
from rcilab.model.dynamics.payload import Payload

_JOINTS = tuple(f"joint {number}" for number in range(1, 8))
_AXES = ("x", "y", "z", "about x", "about y", "about z")
_REASONS = {
    RobotMode.REFLEX: ("fault", "a fault has stopped the arm: recover() clears it"),
    RobotMode.USER_STOPPED: ("user_stopped", "the user stop is pressed: release it first"),
    RobotMode.GUIDING: ("guided_by_hand", "the arm is guided by hand: release the button at the hand first"),
    RobotMode.AUTOMATIC_ERROR_RECOVERY: (
        "recovering",
        "an error recovery is in progress: try again when it is over",
    ),
    RobotMode.MOVE: ("moving", "a motion is in progress: wait for its end, or stop it first"),
    RobotMode.OTHER: ("not_ready", "the arm is not ready: unlock its joints and activate FCI in Desk"),
}
"""Why a request is refused: the key of its text, and the sentence."""
_MASS_DIGITS = 6  # [kg] That single precision has of a load; 3 kg must not become more than the arm is rated for.
_STATE_TIMEOUT = 1.0  # [s] For a state that shows a change; they come every millisecond.
_RECOVERY_TIMEOUT = 20.0  # [s] For the answer to a recovery, which moves the arm back. A tuning value.
_CLEAR_TIMEOUT = 3.0  # [s] For the error flags to clear after the controller has accepted the recovery.


class FciSettings:
    """The requests of libfranka's `Robot` that are no motion.

    Refusals raise `CommandRejectedError`, a broken connection `ConnectionLostError`; arguments of the wrong shape, not
    finite or out of range raise `InvalidValueError` and are not sent.

    Args:
        client: The connection.
        name: Name of the controller in errors.
    """

    def __init__(self, client: FciClient, name: str) -> None:
        self._client = client
        self._name = name

    def set_collision_behavior(
        self, lower_torques: ArrayLike, upper_torques: ArrayLike, lower_forces: ArrayLike, upper_forces: ArrayLike
    ) -> None:
        """Sets thresholds of external torques and forces: above the lower one a contact, above the upper one a stop.

        Args:
            lower_torques: Of contacts, shape (7,), [N m].
            upper_torques: Of collisions, shape (7,), [N m].
            lower_forces: Of contacts, in the stiffness frame, shape (6,), [N, N m].
            upper_forces: Of collisions, shape (6,), [N, N m].
        """
        low = bounded_vector("lower_torques", lower_torques, _JOINTS, "N m", 0.0)
        high = bounded_vector("upper_torques", upper_torques, _JOINTS, "N m", low)
        light = bounded_vector("lower_forces", lower_forces, _AXES, "N, N m", 0.0)
        heavy = bounded_vector("upper_forces", upper_forces, _AXES, "N, N m", light)
        with self._request("setCollisionBehavior"):
            self._client.robot.set_collision_behavior(*(values.tolist() for values in (low, high, light, heavy)))
        self._client.thresholds = CollisionThresholds(high.tolist(), heavy.tolist())

    def set_joint_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of the joints in every mode but Cartesian impedance and torques, shape (7,), [N m/rad]."""
        values = bounded_vector("stiffness", stiffness, _JOINTS, "N m/rad", 0.0, LARGEST_JOINT_STIFFNESS)
        with self._request("setJointImpedance"):
            self._client.robot.set_joint_impedance(values.tolist())

    def set_cartesian_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of Cartesian impedance, shape (6,): three [N/m], three [N m/rad]."""
        least, largest = np.repeat(np.array(CARTESIAN_STIFFNESS).T, 3, axis=1)
        values = bounded_vector("stiffness", stiffness, _AXES, "N/m, N m/rad", least, largest)
        with self._request("setCartesianImpedance"):
            self._client.robot.set_cartesian_impedance(values.tolist())

    def set_k(self, EE_T_K: Pose) -> None:
        """Sets the stiffness frame in the end effector's, at most 2 m away: the axes of impedance and of forces."""
        frame = _near_pose("EE_T_K", EE_T_K)
        with self._request("setK"):
            self._client.set_k(columns_of(frame.matrix))

    def set_ee(self, NE_T_EE: Pose) -> None:
        """Sets the end effector in the nominal end-effector frame that is set in Desk, at most 2 m away."""
        frame = _near_pose("NE_T_EE", NE_T_EE)
        with self._request("setEE"):
            self._client.set_ee(columns_of(frame.matrix))
        self._await_state()

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load, in addition to the end effector that is set in Desk.

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2].
        """
        load = as_load(mass, center_of_mass, inertia)
        with self._request("setLoad"):
            self._client.robot.set_load(load.mass, load.center_of_mass.tolist(), load.inertia.ravel().tolist())
        self._await_state()

    def automatic_error_recovery(self) -> None:
        """Clears the errors and returns once they are gone."""
        with self._request("automaticErrorRecovery", _RECOVERY_TIMEOUT):
            self._client.robot.automatic_error_recovery()
        deadline = time.monotonic() + _CLEAR_TIMEOUT
        while time.monotonic() < deadline:
            self._client.poll(_STATE_TIMEOUT)
            if not errors_of(self._client.newest.current_errors):
                return
        names = name_faults(errors_of(self._client.newest.current_errors))
        raise DeadlineError(
            f"{self._name}: {names} did not clear within {_CLEAR_TIMEOUT:g} s; remove the cause first"
        ).coded("not_cleared", faults=names, seconds=f"{_CLEAR_TIMEOUT:g}")

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the end effector by its pose in the flange frame."""
        tool = _near_pose("T_flange_tool", T_flange_tool)
        self.set_ee(self._nominal_frame().inverse() @ tool)

    @property
    def tool(self) -> Pose:
        """Pose of the end effector in the flange frame, as the newest state reports it."""
        return pose_of(self._client.newest.F_T_EE)

    @property
    def end_effector(self) -> Payload:
        """The body that is set in Desk, such as the hand, as the newest state reports it."""
        state = self._client.newest
        return body_of(state.m_ee, state.F_x_Cee, state.I_ee)

    @property
    def load(self) -> Payload:
        """The load of `set_load`, as the newest state reports it."""
        state = self._client.newest
        return body_of(state.m_load, state.F_x_Cload, state.I_load)

    def _nominal_frame(self) -> Pose:
        """Returns the frame that is set in Desk, in the flange frame."""
        columns = getattr(self._client.newest, "F_T_NE", None)
        if columns is not None:
            return pose_of(columns)
        self.set_ee(IDENTITY)  # panda-python does not report it: the end effector is there now.
        return self.tool

    def _await_state(self) -> None:
        """Returns once a state has arrived that was sent after a request."""
        self._client.poll(0.0)
        if self._client.poll(_STATE_TIMEOUT) is None:
            raise ConnectionLostError(f"{self._name}: no state for {_STATE_TIMEOUT:g} s; connect again")

    @contextmanager
    def _request(self, name: str, timeout: float = ANSWER_TIMEOUT) -> Iterator[None]:
        """Calls for a request, as `FciClient.request`; the state gives the reason of a refusal."""
        try:
            with self._client.request(name, timeout):
                yield
        except CommandRejectedError as refusal:
            self._client.poll(0.0)
            reason = find_reason(self._client)
            if reason is None:
                raise
            raise refusal_of(name, reason) from refusal.__cause__


def find_reason(client: FciClient) -> tuple[str, str] | None:
    """Returns why a controller refuses requests at present: a key and a sentence; None if it does not."""
    return _REASONS.get(RobotMode(int(client.newest.robot_mode)))


def refusal_of(command: str, reason: tuple[str, str]) -> CommandRejectedError:
    """Returns the error of a request that a controller refuses at present: our reason replaces the library's text."""
    word, sentence = reason
    return CommandRejectedError(command, "not possible", sentence, reason=word)


def as_load(mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> Payload:
    """Returns a load as a body; how heavy it may be is a matter of the arm.

    Raises:
        InvalidValueError: It is not a possible body, or too far away.
    """
    kilograms = float(bounded_vector("mass", [mass], ("",), "kg", 0.0)[0])
    center = bounded_vector("center_of_mass", center_of_mass, _AXES[:3], "m")
    _require_near("center_of_mass", center)
    return Payload(mass=kilograms, center_of_mass=center, inertia=inertia)  # type: ignore[arg-type]  # Checked there.


def pose_of(columns: list[float]) -> Pose:
    """Returns the pose of a column-major transform; its numbers may have single precision."""
    return as_pose(np.array(columns).reshape(4, 4).T)


def body_of(mass: float, center: list[float], inertia: list[float]) -> Payload:
    """Returns a body of a state, with the nearest inertia of a possible one: single precision rounds its numbers."""
    kilograms = round(mass, _MASS_DIGITS)
    if kilograms == 0.0:
        return Payload()
    tensor = np.array(inertia).reshape(3, 3)
    moments, axes = np.linalg.eigh((tensor + tensor.T) / 2.0)
    moments = np.maximum(moments, 0.0)
    moments[2] = min(moments[2], moments[0] + moments[1])
    return Payload(mass=kilograms, center_of_mass=np.array(center), inertia=axes * moments @ axes.T)


def _near_pose(name: str, value: object) -> Pose:
    pose = as_pose(value, name)  # type: ignore[arg-type]  # Checked there.
    _require_near(name, np.array(pose.parts[1]))
    return pose


def _require_near(name: str, position: Array) -> None:
    length = float(np.linalg.norm(position))
    if not length <= LONGEST_TOOL:
        raise InvalidValueError(
            name, round(length, 6), f"m from the flange is farther than {LONGEST_TOOL:g} m; give metres"
        )
