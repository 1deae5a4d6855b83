"""The commands of the RCI as methods: power, motion, drag, inputs and outputs; refusals become errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from rcilab.core.errors import CommandRejectedError
from rcilab.core.state import ControllerMode
from rcilab.makers.driver import SignalRequest, require_signal
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.bounds import SIGNAL_NAMES
from rcilab.makers.rokae.driver.connection import PostedRequest
from rcilab.makers.rokae.driver.settings import RciSettings, flag, member


class RciCommands(RciSettings):
    """The commands of the RCI manual, section 3.1.

    Refusals raise `CommandRejectedError`, a missing answer `DeadlineError`, a broken connection
    `ConnectionLostError`; arguments of the wrong shape, not finite or out of range raise `InvalidValueError` and are
    not sent.
    """

    def connect(self) -> None:
        """Sends our UDP port to the controller. Not needed: the vendor's client never sends this command."""
        self._ask(rci.Connect(self._link.local_address[1]))

    def set_motor_power(self, power: bool) -> None:
        """Switches the motors on or off."""
        self._ask(rci.SetMotorPower(int(flag("power", power))))

    def motor_state(self) -> bool:
        """Returns whether the motors are on."""
        return bool(self._request(rci.GetMotorState()).power)

    def start_move(self, controller_mode: ControllerMode, motion_mode: rci.StartMotionMode) -> None:
        """Starts a motion; commands must follow at once. `execute` and `control` do this by themselves."""
        self._ask(rci.StartMove(controller_mode, motion_mode), rci.StartStatus.MOTION_STARTED)

    def stop_move(self, timeout: float | None = None) -> None:
        """Ends a motion.

        Args:
            timeout: For the answer, [s]; None: that of every request.
        """
        self._ask(rci.StopMove(), timeout=timeout)

    def automatic_error_recovery(self) -> None:
        """Asks the controller to clear its faults; a refusal says which of the manual's reasons it has."""
        self._ask(rci.AutomaticErrorRecovery())

    def load_model(self) -> rci.ModelResponse:
        """Returns the controller's figures of the arm: DH rows and base dynamic parameters.

        Raises:
            CommandRejectedError: The controller has none.
        """
        response: rci.ModelResponse = self._request(rci.LoadRobotModel())
        if response.status != rci.GuideStatus.SUCCESS:
            raise CommandRejectedError("LoadRobotModel", response.status)
        return response

    def set_do(self, signal: int, level: bool) -> None:
        """Sets a digital output, 0 to 5."""
        self._ask(rci.SetDO(require_signal(signal, SIGNAL_NAMES), flag("level", level)))

    def get_di(self, signal: int) -> bool:
        """Returns the level of a digital input, 0 to 5."""
        return bool(self._request(rci.GetDIState(require_signal(signal, SIGNAL_NAMES))).level)

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal during a motion; see `StreamingDriver`."""
        number = require_signal(signal, SIGNAL_NAMES)
        request = rci.GetDIState(number) if level is None else rci.SetDO(number, flag("level", level))
        return _PostedSignal(self._link.post(request), self.require_done)

    def start_drag(
        self,
        space: rci.DragSpace | Literal["joint", "cartesian"] = rci.DragSpace.JOINT,
        type: rci.DragType | Literal["translation", "rotation", "free"] = rci.DragType.FREE,
    ) -> None:
        """Starts hand guiding, until `stop_drag`.

        Args:
            space: Space of the constraints: in joint space the type has no effect.
            type: The free directions in Cartesian space.
        """
        self._ask(rci.StartDrag(member(rci.DragSpace, "space", space), member(rci.DragType, "type", type)))

    def stop_drag(self) -> None:
        """Ends hand guiding; returns once the arm stands still."""
        self._ask(rci.StopDrag())

    def safety_stop(self) -> rci.SafetyStop:
        """Returns which safety stop is active: none, the emergency stop (ESTOP), or the safety gate (GSTOP)."""
        return self._request(rci.GetSafetyStopState()).state

    def reboot(self) -> None:
        """Restarts the controller; the connection ends with it, `rcilab.connect` makes the next one."""
        self._ask(rci.RebootRobot())


class _PostedSignal:
    """A request for a digital signal, a `SignalRequest`.

    Args:
        posted: The request.
        require_done: Raises the error of a refusal.
    """

    def __init__(self, posted: PostedRequest, require_done: Callable[[rci.Request, Any], None]) -> None:
        self._posted, self._require_done = posted, require_done

    def poll(self) -> bool | None:
        """Returns the level, or None until the answer; never waits."""
        answer = self._posted.poll()
        if answer is None:
            return None
        if isinstance(self._posted.request, rci.GetDIState):
            return bool(answer.level)
        self._require_done(self._posted.request, answer.status)
        return True
