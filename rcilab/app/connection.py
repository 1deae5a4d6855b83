"""The interface of a robot that a control process or a session drives. Nothing here waits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rcilab.cell.cell import Cell
    from rcilab.conformance.certificate import Certificate
    from rcilab.control_process import PendingRequest, Supervisor, SupervisorStatus
    from rcilab.core.state import Mode
    from rcilab.makers.configuration import RobotConfiguration
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion.motion import Motion
    from rcilab.motion.speed_scaling import SpeedScaledMotion
    from rcilab.recording.run import Run


class Robot(Protocol):
    """Takes requests; `rcilab.control_process.Supervisor` is an implementation."""

    @property
    def scaled_motion(self) -> SpeedScaledMotion | None:
        """The motion in progress, or the last one, with its speed override; None if the run itself holds it."""
        ...

    def power_on(self) -> PendingRequest:
        """Switches motor power on."""
        ...

    def power_off(self) -> PendingRequest:
        """Switches motor power off."""
        ...

    def recover(self) -> PendingRequest:
        """Clears the controller's faults."""
        ...

    def execute(
        self,
        motion: Motion,
        certificate: Certificate,
        mode: Mode = "joint_position",
        *,
        speed_override: float = 1.0,
        stops: int | None = None,
    ) -> PendingRequest:
        """Streams a checked motion; see `rcilab.control_process.Supervisor.execute`."""
        ...

    def set_speed_override(self, speed_override: float) -> PendingRequest:
        """Sets the speed override of the motion in progress."""
        ...

    def pause(self) -> PendingRequest:
        """Pauses the motion in progress."""
        ...

    def configure(self, setup: RobotConfiguration) -> PendingRequest:
        """Sends tool, load, limits or parameters; the status has the acknowledged values."""
        ...

    def set_output(self, signal: int, level: bool) -> PendingRequest:
        """Sets a digital output by its number, and reads the inputs; the status has both."""
        ...

    def read_inputs(self) -> PendingRequest:
        """Reads the digital inputs; the status has them."""
        ...

    def reboot(self) -> PendingRequest:
        """Restarts the controller; the connection ends with it."""
        ...

    def drain(self) -> NDArray[np.void]:
        """Returns the cycles since the last call if the robot does not record a run itself."""
        ...


class Connection(Protocol):
    """The current robot."""

    def status(self) -> SupervisorStatus:
        """Returns its status."""
        ...

    def robot(self) -> Robot:
        """Returns the object that takes requests.

        Raises:
            StartingError: The control process has not started yet.
        """
        ...

    def take_run(self) -> Run | None:
        """Returns the last run of `execute` if the robot recorded it itself; None: it is built from drained cycles."""
        ...


class PageConnection(Protocol):
    """The robot of the page: one that its own control process drives, or one that it only watches."""

    @property
    def is_ready(self) -> bool:
        """Whether `robot` returns one."""
        ...

    @property
    def stops(self) -> int:
        """Number of stops so far."""
        ...

    def open(
        self,
        model: RobotModel,
        target: str,
        plant: str = "ideal",
        setup: RobotConfiguration | None = None,
        cell: Cell | None = None,
    ) -> None:
        """Closes the present robot and connects to this one; a virtual one gets a cell. Returns at once."""
        ...

    def disconnect(self) -> None:
        """Closes the present robot; returns at once."""
        ...

    def status(self) -> SupervisorStatus:
        """Returns its status."""
        ...

    def robot(self) -> Supervisor:
        """Returns the object that takes requests.

        Raises:
            UsageError: There is no robot.
        """
        ...

    def take_run(self) -> None:
        """Returns None: a run is built from cycles."""
        ...

    def stop(self) -> None:
        """Stops a motion of this page; never waits."""
        ...

    def heartbeat(self) -> None:
        """Reports an operator at the page."""
        ...

    def close(self) -> None:
        """Ends everything."""
        ...
