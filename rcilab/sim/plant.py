"""The protocol of the arm behind the controller.

Once a millisecond the controller hands its plant a `Setpoint` and gets a `Measurement` back. A plant knows neither
sockets nor modes nor faults; it decides only how an arm answers a setpoint. Commands were checked before they come
here, so a plant may trust them.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointVector, make_readonly
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel


class Drive(Enum):
    """What the joints are driven with during one cycle."""

    BRAKED = "braked"
    """Motors off, brakes closed. The arm stops by itself and stays; setpoints are ignored."""
    POSITION = "position"
    """The servo follows `q` (with `dq` and `ddq` as feed-forward). Also how an arm stands still under power."""
    TORQUE = "torque"
    """`tau` acts at the joints, on top of the compensation of gravity and friction: M ddq + C dq = tau."""


class Setpoint(NamedTuple):
    """What the drives shall do for one millisecond. All vectors are n plain floats; the arm is at them at its end."""

    drive: Drive
    q: Sequence[float]
    """Commanded joint angles, [rad]; what the arm holds, in the drives that do not follow it."""
    dq: Sequence[float]
    """Commanded joint velocities, [rad/s]."""
    ddq: Sequence[float]
    """Commanded joint accelerations, [rad/s^2]."""
    tau: Sequence[float] | Array | None = None
    """Commanded joint torques without gravity and friction, [N m], for TORQUE."""
    arrays: tuple[JointVector, JointVector, JointVector] | None = None
    """q, dq and ddq as arrays, if they are known already."""

    def as_arrays(self) -> tuple[JointVector, JointVector, JointVector]:
        """Returns q, dq and ddq as read-only arrays."""
        if self.arrays is not None:
            return self.arrays
        q, dq, ddq = make_readonly(np.array((self.q, self.dq, self.ddq), dtype=np.float64))
        return q, dq, ddq


class Measurement(NamedTuple):
    """What the sensors of the arm say at the end of a millisecond. Read-only arrays."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    dq: JointVector
    """Joint velocities, shape (n,), [rad/s]."""
    tau: JointVector
    """Torques in the joints, link side, gravity included, shape (n,), [N m]."""


class Plant(Protocol):
    """An arm that answers one setpoint a millisecond. Owned and called by the controller's cycle alone."""

    @property
    def kind(self) -> str:
        """One word for it, such as "ideal"."""
        ...

    def configure(self, model: RobotModel) -> None:
        """Takes a new tool or load, as set by the client; only while the arm is at rest."""
        ...

    def reset(self, q: JointVector) -> Measurement:
        """Puts the arm at `q`, shape (n,), [rad], at rest, without passing through anything, and measures."""
        ...

    def step(self, setpoint: Setpoint) -> Measurement:
        """Advances by one cycle with `setpoint` and measures at its end.

        For a stationary arm with a stationary setpoint (BRAKED, or POSITION with an unchanged `q` and no velocity) the
        measurements must settle to equal numbers, so that a resting robot reports a resting state. It may then return
        the same object: poses and torques are recomputed only for another one.
        """
        ...

    def push(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Applies an external force until the next call; a new push replaces the last.

        Args:
            wrench: Force and moment on the arm, base axes, shape (6,), [N, N m]; zeros let go.
            link: Number of the link that is pressed on, from 1; the tool when absent.
            point: Where the force acts, in the frame of that link (see `Link`), or of the tool, shape (3,), [m]; its
                origin when absent. It moves along with the arm.

        Raises:
            InvalidValueError: Not six and three finite numbers, or the arm has no such link.
        """
        ...

    def mount(self, load: Payload | None) -> None:
        """Fixes a payload to the flange that the controller need not know of.

        Args:
            load: What is really there; None: what the model says (setLoad).
        """
        ...

    def place_box(self, name: str, size: ArrayLike, pose: Pose) -> None:
        """Puts a solid box into the arm's way, or moves it when there is one of this name.

        Args:
            name: How `remove_box` will call it.
            size: Edges along x, y and z of its frame, shape (3,), [m].
            pose: Its centre and directions in the base frame.

        Raises:
            InvalidValueError: The size is not three positive finite numbers, or the arm stands in the box.
            UsageError: This plant knows no contact.
        """
        ...

    def remove_box(self, name: str) -> None:
        """Takes a box away.

        Raises:
            InvalidValueError: There is no box of this name; the message lists those that exist.
        """
        ...

    def set_floor(self, on: bool) -> None:
        """Lets the floor, the plane z = 0 of the base frame, be solid or not.

        Raises:
            UsageError: This plant knows no contact.
        """
        ...

    def set_walls(self, box: SafetyBox | None) -> None:
        """Lets the faces of a safety box be solid walls for the links; None takes them away.

        Raises:
            UsageError: This plant knows no contact.
        """
        ...
