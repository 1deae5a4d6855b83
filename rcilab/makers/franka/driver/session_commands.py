"""The requests of libfranka in a session, `robot.fci`: they take the session's lock and keep its model up to date."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from numpy.typing import ArrayLike

from rcilab.core.errors import ModelError
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ConfiguredArm, RequestLock
from rcilab.makers.franka.bounds import require_payload
from rcilab.makers.franka.driver.client import ANSWER_TIMEOUT, FciClient
from rcilab.makers.franka.driver.configuration import send_configuration
from rcilab.makers.franka.driver.settings import FciSettings, as_load
from rcilab.model.dynamics.payload import POINT_MASS, combine_payloads


class FciSessionCommands(FciSettings):
    """Every request of libfranka that is no motion, for the user of a session; refused while a motion runs.

    Args:
        client: The connection.
        name: Name of the controller in errors.
        arm: The session's configuration.
        lock: The session's lock.
    """

    def __init__(self, client: FciClient, name: str, arm: ConfiguredArm, lock: RequestLock) -> None:
        super().__init__(client, name)
        self._arm = arm
        self._lock = lock

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration; after a refusal, earlier parts are in force."""
        send_configuration(self, configuration)

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the end effector by its pose in the flange frame; the session's `model` has it from then on."""
        with self._lock.acquire("setEE"):
            model = self._arm.model.with_tool(T_flange_tool)
            super().set_tool(T_flange_tool)
            self._arm.model = model

    def set_ee(self, NE_T_EE: Pose) -> None:
        """Sets the end effector in the nominal end-effector frame; the session's `model` has it from then on."""
        with self._lock.acquire("setEE"):
            super().set_ee(NE_T_EE)
            self._arm.model = self._arm.model.with_tool(self.tool)

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike = POINT_MASS) -> None:
        """Sets the load, in addition to the end effector; the session's `model` has both from then on.

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; zero by default.
        """
        with self._lock.acquire("setLoad"):
            load = as_load(mass, center_of_mass, inertia)
            require_payload(load.mass, self.end_effector.mass, self._arm.model.description)
            model = self._arm.model.with_load(combine_payloads(self.end_effector, load))
            super().set_load(load.mass, load.center_of_mass, load.inertia)
            self._arm.model = model

    def set_output(self, signal: int, level: bool) -> None:
        """Raises an error: there are no digital signals."""
        raise _missing("digital signals")

    def read_input(self, signal: int) -> bool:
        """Raises an error: there are no digital signals."""
        raise _missing("digital signals")

    def reboot(self) -> None:
        """Raises an error: there is no such request."""
        raise _missing("restart on request")

    @contextmanager
    def _request(self, name: str, timeout: float = ANSWER_TIMEOUT) -> Iterator[None]:
        with self._lock.acquire(name), super()._request(name, timeout):
            yield


def _missing(feature: str) -> ModelError:
    return ModelError(f"Franka's interface has no {feature}")
