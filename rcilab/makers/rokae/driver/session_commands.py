"""The RCI's own commands in a session, `robot.rci`: they take the session's lock and keep its model up to date."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ConfiguredArm, RequestLock
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.configuration import send_configuration
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.makers.rokae.driver.loaded_arm import LoadedArm, build_loaded_arm
from rcilab.makers.rokae.driver.settings import load_center
from rcilab.makers.rokae.wire import Request, SetMotorPower
from rcilab.makers.rokae.wire.statuses import WHILE_MOVING
from rcilab.model.dynamics.payload import POINT_MASS, Payload
from rcilab.robots import RobotDescription, describe_robot


class RciSessionCommands(RciCommands):
    """Every command of the RCI, for the user of a session.

    During a motion, the requests that a controller answers then may be sent, from any thread and from a callback:
    `set_do`, `get_di`, `safety_stop`, `motor_state`, `load_model`, `set_cart_imp_desired_tau`, and
    `set_motor_power(False)`, which ends the motion. In a callback such a request takes about a millisecond. All others
    are refused and do not disturb the motion.

    Args:
        connection: The connection.
        description: The arm, to check arguments with: its own bounds, without a model's soft limits.
        arm: The session's configuration.
        lock: The session's lock.
    """

    def __init__(
        self, connection: RciConnection, description: RobotDescription, arm: ConfiguredArm, lock: RequestLock
    ) -> None:
        super().__init__(connection, description)
        self._arm = arm
        self._lock = lock

    def load_robot_model(self) -> LoadedArm:
        """Returns the arm as its controller describes it (LoadRobotModel), as a model that can be saved, and compared.

        The model has the session's tool and load; limits and names are those of the table. It is for your computations
        and for `connect(address, model)`; this session keeps its own model.

        Raises:
            CommandRejectedError: The controller has no model.
            ModelError: Its lengths are not those of the session's arm.
        """
        response, model = self.load_model(), self._arm.model
        return build_loaded_arm(response, describe_robot(model.name), self._link.name, model)

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration; after a refusal, earlier parts are in force."""
        send_configuration(self, configuration)

    def set_coor(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame; the session's `model` has it from then on."""
        with self._lock.acquire("SetCoor"):
            model = self._arm.model.with_tool(T_flange_tool)
            super().set_coor(T_flange_tool)
            self._arm.model = model

    def set_cartesian_limit(self, box: SafetyBox) -> None:
        """Sets the safety box for the origin of the tool, and whether it is active."""
        with self._lock.acquire("SetCartesianLimit"):
            super().set_cartesian_limit(box)
            self._arm.safety_box = box

    def set_collision_behavior(self, thresholds: ArrayLike) -> None:
        """Sets the external torques that count as a collision, shape (n,), [N m]; see `limits.joint`."""
        with self._lock.acquire("SetCollisionBehavior"):
            super().set_collision_behavior(thresholds)
            self._arm.collision_thresholds = as_vector(thresholds, self.n, "thresholds")

    def set_joint_limit(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets soft limits of the joint angles; the session's `model` has them from then on, so that motions keep them.

        Args:
            lower: Shape (n,), [rad], inside the arm's own range.
            upper: Shape (n,), [rad].
        """
        with self._lock.acquire("SetJointLimit"):
            super().set_joint_limit(lower, upper)
            self._arm.model = self._arm.model.with_joint_limits(lower, upper)

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike = POINT_MASS) -> None:
        """Sets the load at the flange; the session's `model` has it from then on.

        Args:
            mass: [kg], up to the arm's payload.
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; zero by default.
        """
        with self._lock.acquire("SetLoad"):
            center = load_center(center_of_mass)
            load = Payload(mass=mass, center_of_mass=center, inertia=inertia)  # type: ignore[arg-type]
            model = self._arm.model.with_load(load)
            super().set_load(load.mass, load.center_of_mass, load.inertia)
            self._arm.model = model

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output (`set_do`)."""
        self.set_do(signal, level)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input (`get_di`)."""
        return self.get_di(signal)

    def reboot(self) -> None:
        """Restarts the controller. The session is closed then: connect again once it is up."""
        with self._lock.acquire("RebootRobot"):
            super().reboot()
        self._lock.close()

    def _request(self, request: Request, timeout: float | None = None) -> Any:
        if request.code in WHILE_MOVING or request == SetMotorPower(0):
            with self._lock.acquire_unless_moving() as is_mine:
                if is_mine:
                    return super()._request(request, timeout)
            return self._link.request_alongside(request, timeout)
        with self._lock.acquire(type(request).__name__):
            return super()._request(request, timeout)
