"""The supervisor: starts the control process (and a virtual controller), watches both, and passes requests on."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.supervisor.status import SupervisorStatus

if TYPE_CHECKING:
    from rcilab.conformance import Certificate
    from rcilab.errors import RcilabError
    from rcilab.model import RobotModel
    from rcilab.motion import Motion


class Ticket:
    """A request on its way through the control process."""

    @property
    def done(self) -> bool:
        """Whether the request has been carried out or has failed. For `execute`: the arm stands still again."""
        raise NotImplementedError

    @property
    def error(self) -> RcilabError | None:
        """Why it failed; None while it is under way and when it went well."""
        raise NotImplementedError

    def wait(self, timeout: float | None = None) -> None:
        """Returns once the request has been carried out.

        Args:
            timeout: How long to wait, [s]; None waits as long as it takes.

        Raises:
            DeadlineError: It is still under way after `timeout`; it goes on.
            RcilabError: It failed; the same object as `.error`.
        """
        raise NotImplementedError


class Supervisor:
    """Runs motions in a process of its own, so that nothing the page does can disturb a cycle.

    All methods may be called from any thread. Requests return a `Ticket` at once; nothing here waits for the robot
    except `start()` and `close()`.

    Args:
        model: The arm.
        target: "virtual" for a private virtual controller on loopback, or the address of a controller, rci://HOST:PORT.
        plant: What the virtual controller moves: "ideal" or "mujoco".
        stop_without_operator: Whether a motion is brought to rest once nobody has been at the controls for 2 s (see
            `set_operator_present`). False lets it finish; meant for the virtual controller.
        auto_restart: Whether a process of ours that died is started again by itself (at most 3 times a minute).
    """

    def __init__(
        self,
        model: RobotModel,
        target: str = "virtual",
        plant: str = "ideal",
        *,
        stop_without_operator: bool = True,
        auto_restart: bool = True,
    ) -> None:
        raise NotImplementedError

    def start(self, timeout: float = 15.0) -> None:
        """Starts the processes and returns once states arrive or it is clear that they will not.

        An unreachable robot is no error here: the phase is then "lost" and `reconnect()` tries again.

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Brings a running motion to rest, ends our processes and frees the shared memory. May be called twice."""
        raise NotImplementedError

    def restart(self) -> None:
        """Ends and starts our processes again, whatever state they are in, and returns once states arrive."""
        raise NotImplementedError

    def status(self) -> SupervisorStatus:
        """Returns a snapshot; cheap enough to be taken at the display's rate."""
        raise NotImplementedError

    def power_on(self) -> Ticket:
        """Asks for motor power."""
        raise NotImplementedError

    def power_off(self) -> Ticket:
        """Asks for motor power to be taken away."""
        raise NotImplementedError

    def execute(self, motion: Motion, certificate: Certificate) -> Ticket:
        """Streams a checked motion; the ticket is done when the arm stands still again.

        Args:
            motion: The motion.
            certificate: From `check(motion, model).certificate`.

        Raises:
            CertificateError: The certificate is missing, or does not fit the motion, the model, or where the arm is.
            UsageError: The arm is moving, or no controller is connected.
        """
        raise NotImplementedError

    def stop(self) -> Ticket:
        """Brings a running motion to rest within the limits; done at once when nothing moves."""
        raise NotImplementedError

    def recover(self) -> Ticket:
        """Asks the controller to clear its faults (automatic error recovery)."""
        raise NotImplementedError

    def reconnect(self) -> Ticket:
        """Drops the connection to the controller and makes a new one."""
        raise NotImplementedError

    def set_operator_present(self, present: bool) -> None:
        """Tells that somebody is at the controls; call with True at least once a second while that is so.

        Until the first call nobody is expected. From then on, a motion is brought to rest when the last True is more
        than 2 s ago (`stop_without_operator`), and `execute` is refused meanwhile.
        """
        raise NotImplementedError

    def drain(self) -> NDArray[np.void]:
        """Returns every cycle recorded since the last call, oldest first.

        Returns:
            Structured array, see `cycle_dtype`: message_id, t, q, q_c, dq, command, faults, ... Cycles that were
            overwritten because nobody drained for more than 30 s are missing; `lost` of the first row counts them.
        """
        raise NotImplementedError

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
