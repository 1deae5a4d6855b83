"""The requests of the interface in a session, `robot.xarm`: they take its lock and keep its model up to date."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from numpy.typing import ArrayLike

from rcilab.core.errors import ModelError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ConfiguredArm, RequestLock
from rcilab.makers.ufactory.driver.configuration import send_configuration
from rcilab.makers.ufactory.driver.connection import XArmConnection
from rcilab.makers.ufactory.driver.settings import XArmSettings
from rcilab.model.dynamics.payload import Payload


class XArmSessionCommands(XArmSettings):
    """The requests for the user of a session; while a motion runs, all but `pause`, `resume` and `stop` are refused.

    Args:
        connection: The connection.
        arm: The session's configuration.
        lock: The session's lock.
    """

    def __init__(self, connection: XArmConnection, arm: ConfiguredArm, lock: RequestLock) -> None:
        super().__init__(connection, arm.model.name)
        self._arm = arm
        self._lock = lock

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration; after a refusal, earlier parts are in force."""
        send_configuration(self, configuration)

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the pose of the tool in the flange frame; the session's `model` has it from then on."""
        with self._lock.acquire("set_tcp_offset"):
            model = self._arm.model.with_tool(T_flange_tool)
            super().set_tool(T_flange_tool)
            self._arm.model = model

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load; the session's `model` has it from then on.

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; only the model has it.
        """
        with self._lock.acquire("set_tcp_load"):
            load = Payload(mass=mass, center_of_mass=center_of_mass, inertia=inertia)  # type: ignore[arg-type]
            model = self._arm.model.with_load(load)
            super().set_load(mass, center_of_mass, inertia)
            self._arm.model = model

    def set_boundary(self, box: SafetyBox) -> None:
        """Sets the boundary of the tool; the session checks motions against it from then on."""
        with self._lock.acquire("set_reduced_tcp_boundary"):
            super().set_boundary(box)
            self._arm.safety_box = box

    def set_joint_ranges(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets narrower ranges of the joints; the session's `model` has them from then on.

        Args:
            lower: Shape (n,), [rad], inside the arm's own range.
            upper: Shape (n,), [rad].
        """
        with self._lock.acquire("set_reduced_joint_range"):
            model = self._arm.model.with_joint_limits(lower, upper)
            super().set_joint_ranges(lower, upper)
            self._arm.model = model

    def reboot(self) -> None:
        """Raises an error: see the driver."""
        raise ModelError("rcilab does not restart UFACTORY's control box: switch it off and on")

    @contextmanager
    def _request(self, name: str) -> Iterator[None]:
        with self._lock.acquire(name):
            yield

    @contextmanager
    def _motion(self) -> Iterator[None]:
        with self._lock.move(self.stop):
            yield
