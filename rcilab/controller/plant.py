"""The arm behind the controller: a small protocol, and the arm that follows every setpoint exactly.

Once a millisecond the controller hands its plant a `Setpoint` and gets a `Measurement` back. A plant knows neither
sockets nor modes nor faults; it decides only how an arm answers a setpoint. Commands were judged before they come
here, so a plant may trust them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from rcilab.arrays import Array, JointVector, frozen
from rcilab.model import RobotModel


class Drive(Enum):
    """What the joints are driven with during one cycle."""

    BRAKED = "braked"
    """Motors off, brakes closed. The arm comes to rest by itself and stays; setpoints are ignored."""
    POSITION = "position"
    """The servo follows `q` (with `dq` and `ddq` as feed-forward). Also how an arm stands still under power."""
    IMPEDANCE = "impedance"
    """Joint springs of `stiffness` pull towards `q`; gravity and friction are compensated."""
    TORQUE = "torque"
    """`tau` acts at the joints, on top of the compensation of gravity and friction."""
    GUIDED = "guided"
    """The arm is weightless and yields to outside forces: hand guiding."""


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What the drives shall do for one millisecond. All vectors are n plain floats; the arm is at them at its end."""

    drive: Drive
    q: Sequence[float]
    """Commanded joint angles, [rad]; what the arm holds, in the drives that do not follow it."""
    dq: Sequence[float]
    """Commanded joint velocities, [rad/s]."""
    ddq: Sequence[float]
    """Commanded joint accelerations, [rad/s^2]."""
    stiffness: Sequence[float] | None = None
    """Joint stiffness, [N m/rad], for IMPEDANCE."""
    tau: Sequence[float] | None = None
    """Commanded joint torques, [N m], for TORQUE."""


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What the sensors of the arm say at the end of a millisecond. Read-only arrays."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    dq: JointVector
    """Joint velocities, shape (n,), [rad/s]."""
    tau: JointVector
    """Torques in the joints, gravity included, shape (n,), [N m]."""
    tau_ext: JointVector
    """Share of `tau` that the arm's own model does not explain: contact, shape (n,), [N m]."""
    wrench_ext: Array
    """The same as force and moment on the tool, base axes, at the tool's origin, shape (6,), [N, N m]."""


class Plant(Protocol):
    """An arm that answers one setpoint a millisecond. Owned and called by the controller's cycle alone."""

    @property
    def kind(self) -> str:
        """One word for it, such as "ideal"."""
        ...

    @property
    def drives(self) -> frozenset[Drive]:
        """The drives it can follow; BRAKED and POSITION always. Modes that need another are refused."""
        ...

    def configure(self, model: RobotModel) -> None:
        """Takes a new tool or load, as set by the client; only while the arm is at rest."""
        ...

    def reset(self, q: JointVector) -> Measurement:
        """Puts the arm at `q`, shape (n,), [rad], at rest, without passing through anything, and measures."""
        ...

    def step(self, setpoint: Setpoint) -> Measurement:
        """Lives through one millisecond with `setpoint` and measures at its end.

        An arm at rest that is told to stay (BRAKED, or POSITION with an unchanged `q` and no velocity) must come to
        answer with equal numbers, so that a resting robot reports a resting state. Returning the same object then is
        welcome: the cycle recomputes poses and torques only when it gets another one.
        """
        ...


class IdealPlant:
    """The arm that is exactly where it was told to be; its torques are those of the rigid-body model.

    Nothing outside can touch it. So impedance is exact tracking too (a spring without a load is not stretched), and
    guided by a hand that does not exist it stays where it is. What commands torques (TORQUE) is beyond it.

    Args:
        model: The arm with its tool and load.
    """

    kind = "ideal"
    drives = frozenset({Drive.BRAKED, Drive.POSITION, Drive.IMPEDANCE, Drive.GUIDED})

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._zeros = frozen(np.zeros(model.n))
        self._no_wrench = frozen(np.zeros(6))
        self._rests = True
        self._measurement = self.reset(model.home)

    def configure(self, model: RobotModel) -> None:
        """Takes a new tool or load."""
        self._model = model
        self.reset(self._measurement.q)

    def reset(self, q: JointVector) -> Measurement:
        """Puts the arm at `q`, shape (n,), [rad], at rest."""
        self._rests = True
        return self._measure(frozen(q), self._zeros, self._zeros)

    def step(self, setpoint: Setpoint) -> Measurement:
        """Moves the arm to the setpoint; braked or guided, it stays where it is."""
        last = self._measurement
        if setpoint.drive in (Drive.BRAKED, Drive.GUIDED):
            return last if self._rests else self.reset(last.q)
        stays = not any(setpoint.dq) and not any(setpoint.ddq) and last.q.tolist() == list(setpoint.q)
        if stays and self._rests:
            return last
        self._rests = stays
        return self._measure(frozen(setpoint.q), frozen(setpoint.dq), frozen(setpoint.ddq))

    def _measure(self, q: JointVector, dq: JointVector, ddq: JointVector) -> Measurement:
        tau = self._model.rigid_body.full_torque(q, dq, ddq)
        self._measurement = Measurement(q, dq, frozen(tau), self._zeros, self._no_wrench)
        return self._measurement
