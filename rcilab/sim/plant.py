"""The protocol of the arm behind the controller.

Once a millisecond the controller passes a `Setpoint` to its plant and receives a `Measurement`. A plant has no sockets,
modes or faults; it only simulates the response of an arm to a setpoint. Setpoints come from checked commands.
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
    """Mode of the drives in one cycle."""

    BRAKED = "braked"
    """Motors off, brakes engaged. The arm stops and remains stationary; setpoints are ignored."""
    POSITION = "position"
    """The servo follows `q` (with `dq` and `ddq` as feed-forward). Also used at standstill with power on."""
    TORQUE = "torque"
    """`tau` acts at the joints, on top of the compensation of gravity and friction: M ddq + C dq = tau."""


class Setpoint(NamedTuple):
    """Setpoint of the drives for one millisecond, valid at its end. All vectors are n plain floats."""

    drive: Drive
    q: Sequence[float]
    """Commanded joint angles, [rad]."""
    dq: Sequence[float]
    """Commanded joint velocities, [rad/s]."""
    ddq: Sequence[float]
    """Commanded joint accelerations, [rad/s^2]."""
    tau: Sequence[float] | Array | None = None
    """Commanded joint torques without gravity and friction, [N m], for TORQUE."""
    arrays: tuple[JointVector, JointVector, JointVector] | None = None
    """q, dq and ddq as arrays, if already available."""

    def as_arrays(self) -> tuple[JointVector, JointVector, JointVector]:
        """Returns q, dq and ddq as read-only arrays."""
        if self.arrays is not None:
            return self.arrays
        q, dq, ddq = make_readonly(np.array((self.q, self.dq, self.ddq), dtype=np.float64))
        return q, dq, ddq


class Measurement(NamedTuple):
    """Sensor values at the end of a millisecond. Read-only arrays."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    dq: JointVector
    """Joint velocities, shape (n,), [rad/s]."""
    tau: JointVector
    """Torques in the joints, link side, gravity included, shape (n,), [N m]."""


class Plant(Protocol):
    """A simulated arm with one setpoint per millisecond. Owned by the controller's cycle."""

    @property
    def kind(self) -> str:
        """Name of the plant, such as "ideal"."""
        ...

    def configure(self, model: RobotModel) -> None:
        """Sets a new tool or load, as configured by the client; only at standstill."""
        ...

    def reset(self, q: JointVector) -> Measurement:
        """Places the arm at `q`, shape (n,), [rad], at standstill, and measures."""
        ...

    def step(self, setpoint: Setpoint) -> Measurement:
        """Advances by one cycle with `setpoint` and measures at its end.

        For a stationary arm with a stationary setpoint (BRAKED, or POSITION with an unchanged `q` and no velocity) the
        measurements must settle to equal numbers, so that a stationary robot reports a constant state. It may then
        return the same object: poses and torques are recomputed only for another object.
        """
        ...

    def push(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Applies an external force until the next call; a new push replaces the last.

        Args:
            wrench: Force and moment on the arm, base axes, shape (6,), [N, N m]; zeros remove it.
            link: Number of the link, from 1; None: the tool.
            point: Where the force acts, in the frame of that link (see `Link`), or of the tool, shape (3,), [m];
                None: its origin. It moves with the arm.

        Raises:
            InvalidValueError: The values are not six and three finite numbers, or the link does not exist.
        """
        ...

    def mount(self, load: Payload | None) -> None:
        """Attaches a physical payload to the flange, which may differ from the controller's load.

        Args:
            load: The physical payload; None: that of the model (setLoad).
        """
        ...

    def place_box(self, name: str, size: ArrayLike, pose: Pose) -> None:
        """Adds a solid box, or moves the box with this name.

        Args:
            name: Its name, for `remove_box`.
            size: Edge lengths along x, y and z of its frame, shape (3,), [m].
            pose: Its centre and orientation in base.

        Raises:
            InvalidValueError: The size is not three positive finite numbers, or the box overlaps the arm.
            UsageError: This plant does not simulate contact.
        """
        ...

    def remove_box(self, name: str) -> None:
        """Removes a box.

        Raises:
            InvalidValueError: The box does not exist; the message lists the existing ones.
        """
        ...

    def find_overlap(self, q: JointVector) -> str | None:
        """Returns which link, tool or part would overlap which solid at `q`, shape (n,), [rad]; None if it is free."""
        ...

    def set_floor(self, on: bool) -> None:
        """Adds or removes a solid floor, the plane z = 0 of the base frame, or the floor of the cell.

        Raises:
            UsageError: This plant does not simulate contact.
        """
        ...

    def require_contact(self, what: str) -> None:
        """Requires a plant that simulates contact.

        Args:
            what: What it is needed for, such as "walls", for the message.

        Raises:
            UsageError: It does not.
        """
        ...

    def set_walls(self, box: SafetyBox | None) -> None:
        """Makes the faces of a safety box solid walls for the links; None removes them.

        Raises:
            UsageError: This plant does not simulate contact.
        """
        ...
