"""A connection of the maker's client library: its calls, and the errors of their codes."""

from __future__ import annotations

import io
import time
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from typing import Any

from rcilab.core.errors import CommandRejectedError, ConnectionLostError
from rcilab.core.optional_deps import require_library
from rcilab.makers.network import HostRoute
from rcilab.makers.realman.errors import errors_of_codes

_DONE, _REFUSED, _UNSENT, _UNANSWERED, _UNKNOWN = 0, 1, -1, -2, -4
_QUIET = 4  # Level of the library's log above its errors: these are raised here.
_TIMEOUT = 1000  # [ms] For an answer; the library's own is 500 ms, which a busy machine exceeds.
_NO_FORCE = -1  # Coordinates of forces: an arm without a force sensor has none.
_NO_ROBOT = -1


def load_client_library() -> Any:
    """Returns the module of the maker's client library.

    Raises:
        MissingExtraError: It is not installed; the message has the command that installs it.
    """
    return require_library("Robotic_Arm.rm_robot_interface", "driving a RealMan arm", "realman")


class RealManClient:
    """A connected client library. Its requests may be made from any thread; the library waits for their answers.

    Attributes:
        api: The library's client; angles in degrees, lengths in metres.

    Args:
        route: The controller's host, and our address.
        port: Its TCP port.
        name: Name of the controller in errors.
        n: Number of joints.

    Raises:
        ConnectionLostError: The library does not connect.
        MissingExtraError: It is not installed.
    """

    def __init__(self, route: HostRoute, port: int, name: str, n: int) -> None:
        self.library = load_client_library()
        self.name, self.n = name, n
        self._local = route.local
        self._loss = ""  # Why the connection is lost.
        with redirect_stdout(io.StringIO()):  # It prints its version.
            self.api = self.library.RoboticArm(self.library.rm_thread_mode_e.RM_DUAL_MODE_E)
        if self.api.rm_create_robot_arm(route.host, port, _QUIET).id == _NO_ROBOT:
            raise ConnectionLostError(
                f"{name}: the client library does not connect; it holds five robots in a process at most: close "
                "sessions that are not needed, and try again"
            )
        self.api.rm_set_timeout(_TIMEOUT)

    def request(self, call: Callable[..., Any], *arguments: Any) -> Any:
        """Returns the values of a call, without its code; None for a call that only has a code.

        Args:
            call: A method of `api`.
            arguments: Its arguments.

        Raises:
            ConnectionLostError: The controller does not answer.
            CommandRejectedError: The library or the controller refuses.
        """
        if self._loss:
            raise ConnectionLostError(self._loss)
        start = time.monotonic()
        code, values = _split(call(*arguments))
        if code == _DONE:
            return values
        name = call.__name__
        if code == _UNSENT or (code == _UNANSWERED and _split(self.api.rm_get_joint_degree())[0] != _DONE):
            raise self.lost(name, f"no answer within {time.monotonic() - start:.1f} s")
        raise self._refusal(name, code)

    def send_angles(self, angles_deg: list[float]) -> None:
        """Streams joint angles, [deg], to be followed on a curve through them, without an answer.

        Raises:
            ConnectionLostError: They cannot be sent.
        """
        if self.api.rm_movej_canfd(angles_deg, True, 0, _ON_A_CURVE, 0) != _DONE:
            raise self.lost("rm_movej_canfd", "it cannot be sent")

    def push_states(self, port: int, *, on: bool = True) -> None:
        """Lets the controller push its states to a UDP port of ours, every 5 ms, or ends that.

        Raises:
            CommandRejectedError: It refuses.
            ConnectionLostError: The connection is lost.
        """
        members = self.library.rm_udp_custom_config_t(joint_speed=1, arm_current_status=1)
        config = self.library.rm_realtime_push_config_t(1, on, port, _NO_FORCE, self._local, members)
        self.request(self.api.rm_set_realtime_push, config)

    def pushed_port(self) -> int:
        """Returns the UDP port to which the controller pushes its states."""
        return int(self.request(self.api.rm_get_realtime_push)["port"])

    def lost(self, request: str, reason: str) -> ConnectionLostError:
        """Returns the error of a lost connection, which all later requests have."""
        self._loss = (
            f"{self.name}: the connection is lost ({reason}, {request}); look whether the controller runs, and connect "
            "again"
        )
        return ConnectionLostError(self._loss)

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._loss = self._loss or f"{self.name}: the connection was closed"
        if self.api.handle is not None:
            self.api.rm_delete_robot_arm()
            self.api.handle = None

    def _refusal(self, name: str, code: int) -> CommandRejectedError:
        if code == _UNKNOWN:
            return CommandRejectedError(name, "controllers of this generation do not have it")
        if code != _REFUSED:
            return CommandRejectedError(name, f"code {code} of the client library")
        with suppress(ConnectionLostError, CommandRejectedError):
            words = self.request(self.api.rm_get_joint_err_flag)["err_flag"][: self.n]
            errors = errors_of_codes(self._read_errors(), words)
            if errors:
                text = f"{errors[0].manual_name}: {errors[0].cause}; {errors[0].remedy}"
                return CommandRejectedError(name, "an error is set", f"{text}. recover() clears it", reason="fault")
            enabled = self.request(self.api.rm_get_joint_en_state)[: self.n]
            if not all(enabled):
                joints = ", ".join(str(joint) for joint, on in enumerate(enabled, 1) if not on)
                return CommandRejectedError(
                    name, f"joint {joints} disabled", "power_on() enables all joints", reason="power_off"
                )
        return CommandRejectedError(name, "the controller refuses it")

    def _read_errors(self) -> list[int]:
        return [int(code) for code in self.request(self.api.rm_get_current_arm_state)["err"]["err"]]


_ON_A_CURVE = 1
"""Trajectory mode of streamed angles. 0 follows each of them at once, 2 by a low-pass filter."""


def _split(answer: Any) -> tuple[int, Any]:
    """Returns code and values of what a method of the library returns."""
    if isinstance(answer, dict):
        return answer["return_code"], answer
    return answer if isinstance(answer, tuple) else (answer, None)
