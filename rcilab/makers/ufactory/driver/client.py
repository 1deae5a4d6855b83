"""A connection of the maker's client library: its calls, and the content of its slow reports."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from rcilab.core.errors import CommandRejectedError, ConnectionLostError
from rcilab.makers.ufactory.driver.library import load_client_library
from rcilab.makers.ufactory.driver.links import Endpoint
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.realtime.scheduling import set_thread_scheduling

_TIMEOUT = 1.0  # [s] For an answer; the library's own is 2 s.
_SHORT_TIMEOUT = 0.4  # [s] In a motion, which no state reaches meanwhile; a control process must answer within 1 s.
_DONE, _HAS_ERROR, _HAS_WARNING, _TIMED_OUT, _NOT_READY, _INVALID = 0, 1, 2, 3, 9, 10
_UNREADY, _OUT_OF_RANGE = -2, -8  # Of the library itself.
_LOST = (-1, 11)
_FIRST_REPORT = 2.0  # [s]
_PAUSE = 0.005  # [s]
_ANSWERS = "main-socket"  # The library's name for the connection on which it receives answers.


class SlowReport(NamedTuple):
    """What is only in the reports that come five times a second."""

    received_ns: int
    """Monotonic, [ns]."""
    error: int
    enabled: tuple[bool, ...]
    """Whether motors are on, by joint."""


class XArmClient:
    """A connected client library. Its requests may be made from any thread, its reports arrive in a thread of its own.

    Attributes:
        api: The library's client; angles in radians, lengths in millimetres.
        slow: The newest slow report.

    Args:
        endpoint: Where the controller listens.
        name: Name of the controller in errors.
        n: Number of joints.

    Raises:
        ConnectionLostError: The library does not connect.
        MissingExtraError: It is not installed.
    """

    def __init__(self, endpoint: Endpoint, name: str, n: int) -> None:
        open_client = load_client_library()
        self.name = name
        self.slow: SlowReport | None = None
        self._n = n
        self._timeout = _TIMEOUT
        self._loss = ""  # Why the connection is lost.
        options = {"forbid_uds": not endpoint.is_local, "timed_comm": False, "check_cmdnum_limit": False}
        self.api = open_client(endpoint.host, is_radian=True, do_not_open=True, check_is_pause=False, **options)
        self.api.register_report_callback(
            self._receive, report_cartesian=False, report_joints=False, report_mtbrake=False, report_cmd_num=False
        )
        before = set(threading.enumerate())
        try:
            self.api.connect()
        except Exception as error:  # The library raises the base class.
            self.close()
            raise ConnectionLostError(f"{name}: the client library does not connect ({error}); try again") from error
        new = set(threading.enumerate()) - before
        self._readers = [thread for thread in new if getattr(thread, "port_type", "") == _ANSWERS]
        self.hurry(False)
        deadline = time.monotonic() + _FIRST_REPORT
        while self.slow is None:
            if time.monotonic() > deadline:
                self.close()
                raise ConnectionLostError(f"{name}: no report within {_FIRST_REPORT:g} s; try again")
            time.sleep(_PAUSE)

    def request(self, name: str, call: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        """Returns the values of a call that is no motion, without its code; None for a call that only has a code.

        It is carried out whether or not the arm is ready for motions.

        Args:
            name: Name of the request in errors.
            call: A method of `api`.
            arguments: Its arguments.
            options: Its keyword arguments.

        Raises:
            ConnectionLostError: The controller does not answer.
            CommandRejectedError: The library or the controller refuses.
        """
        code, values = self._call(name, call, *arguments, **options)
        if code not in (_DONE, _HAS_ERROR, _HAS_WARNING, _NOT_READY):
            raise self.refusal(name, code)
        return values

    def command(self, name: str, call: Callable[..., Any], *arguments: Any, **options: Any) -> None:
        """Makes the call of a motion; arguments and errors as of `request`."""
        code, _ = self._call(name, call, *arguments, **options)
        if code not in (_DONE, _HAS_WARNING):
            raise self.refusal(name, code)

    def refusal(self, name: str, code: int = _NOT_READY) -> CommandRejectedError:
        """Returns the error of a request that was refused with a code of the library."""
        if code == _OUT_OF_RANGE:
            return CommandRejectedError(name, "a joint angle is outside its range", reason="out_of_range")
        if code == _INVALID:
            return CommandRejectedError(name, "the controller has no result for these values", reason="no_result")
        if code not in (_HAS_ERROR, _NOT_READY, _UNREADY):
            return CommandRejectedError(name, f"code {code} of the client library")
        error = self.read_error()
        if error:
            advice = f"{describe_error(error)}; recover() clears it once its cause is removed"
            return CommandRejectedError(name, "an error is set", advice, reason="fault")
        if not self.is_enabled:
            return CommandRejectedError(name, "the motors are off", "switch them on: power_on()", reason="power_off")
        return CommandRejectedError(name, "the arm is not ready", "power_on() makes it ready", reason="not_set_ready")

    @property
    def is_enabled(self) -> bool:
        """Whether the motors of all joints are on, by the newest slow report."""
        assert self.slow is not None  # Since the connection.
        return all(self.slow.enabled)

    def read_error(self) -> int:
        """Returns the number of the error that is set; 0: none."""
        return int(self.request("get_err_warn_code", self.api.get_err_warn_code)[0])

    def enter(self, mode: int) -> None:
        """Sets a mode and makes the arm ready for its commands.

        Raises:
            CommandRejectedError: The arm is not ready; the message has the reason.
        """
        self.request("set_mode", self.api.set_mode, mode)
        self.request("set_state", self.api.set_state, 0)
        if self.request("get_state", self.api.get_state) >= _STOPPED:
            raise self.refusal("set_state")

    def hurry(self, on: bool) -> None:
        """Waits less long for answers from here on, or as long as usual.

        Meanwhile the thread in which the library receives them has the scheduling of the calling one, which waits for
        it: otherwise any ordinary process could delay a stream in real time.
        """
        self._timeout = _SHORT_TIMEOUT if on else _TIMEOUT
        self.api.set_timeout(self._timeout)
        for thread in self._readers:
            set_thread_scheduling(thread, like_caller=on)

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        with suppress(AttributeError):  # Of a client that never connected.
            self.api.disconnect()

    def _call(self, name: str, call: Callable[..., Any], *arguments: Any, **options: Any) -> tuple[int, Any]:
        if self._loss:
            raise ConnectionLostError(self._loss)
        answer = call(*arguments, **options)
        if isinstance(answer, list):  # Of a setter: the code alone.
            answer = answer[0]
        code, values = answer if isinstance(answer, tuple) else (answer, None)
        if code in _LOST or code == _TIMED_OUT or not self.api.connected:
            reason = f"no answer within {self._timeout:g} s" if self.api.connected else "it closed the connection"
            self._loss = (
                f"{self.name}: the connection is lost ({reason}, {name}); look whether the controller runs, and "
                "connect again"
            )
            raise ConnectionLostError(self._loss)
        return code, values

    def _receive(self, report: dict[str, Any]) -> None:
        enabled = tuple(bool(on) for on in report["mtable"][: self._n])
        self.slow = SlowReport(time.monotonic_ns(), report["error_code"], enabled)


_STOPPED = 4  # And above: states in which nothing moves.


def faults_of(error: int) -> tuple[UfactoryError, ...]:
    """Returns the error of a number; () for 0 and for a number that rcilab does not know."""
    return (UfactoryError(error),) if error in _KNOWN else ()


def describe_error(error: int) -> str:
    """Returns the name and the cause of an error."""
    if error not in _KNOWN:
        return f"error C{error} of the controller"
    fault = UfactoryError(error)
    return f"{fault.manual_name}: {fault.cause}"


_KNOWN = frozenset(fault.value for fault in UfactoryError)
