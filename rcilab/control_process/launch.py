"""Starting a virtual controller of our own in a process of its own."""

from __future__ import annotations

import os
import re
import select
import signal
import tempfile
import time
from collections.abc import Sequence
from typing import IO

from rcilab.control_process.fork_order import Order
from rcilab.control_process.forked import Forked, fork_server
from rcilab.core.errors import ConnectionLostError, InvalidValueError

START_TIMEOUT = 20.0  # [s] A cold Python with its numerical libraries takes about 1 s; a busy machine several.
_END_TIMEOUT = 3.0  # [s] Between asking a process to end and ending it.
_LISTENING = re.compile(r"^listening (rci://\S+)( |$)")
_WORLD = re.compile(r"^world (\S+)$", re.MULTILINE)
_TAIL = 2000  # [bytes] of what a process said last that go into an error.


def require_plant(plant: object) -> None:
    """Makes sure that a virtual controller knows this plant.

    Raises:
        InvalidValueError: It does not; the message lists those it knows.
    """
    from rcilab.makers.rokae.controller.config import PLANT_KINDS

    if plant not in PLANT_KINDS:
        raise InvalidValueError("plant", plant, f"is unknown; known: {', '.join(PLANT_KINDS)}")


class ManagedProcess:
    """A process of ours with what it says kept for error messages.

    Args:
        module: What to run: its `main` is given the arguments and returns the exit code.
        arguments: See above.
        name: What to call it in errors.
        descriptors: Open files it inherits, under the same numbers.
    """

    def __init__(self, module: str, arguments: Sequence[str], name: str, descriptors: Sequence[int] = ()) -> None:
        self.name = name
        self._stderr: IO[bytes] = tempfile.TemporaryFile()
        self._stdout, stdout = os.pipe()
        order = Order(
            module=module,
            arguments=tuple(arguments),
            environment=dict(os.environ),
            folder=_here(),
            descriptors=tuple(descriptors),
        )
        try:
            self._process = Forked(order, [stdout, self._stderr.fileno(), *descriptors])
        except OSError as error:
            os.close(self._stdout)
            self._stderr.close()
            raise ConnectionLostError(f"{name} could not be started: {error}").coded("no_process") from error
        finally:
            os.close(stdout)

    @property
    def pid(self) -> int | None:
        """Process id; None as long as it is none."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs, or is about to."""
        return not self._process.wait(0.0)

    @property
    def how_it_ended(self) -> str:
        """In words, such as "signal 9 (SIGKILL)"."""
        if self.is_alive:
            return "it is running"
        code = self._process.exit_code
        if code is None:
            return "nobody saw how"
        return f"signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"exit code {code}"

    @property
    def last_words(self) -> str:
        """The end of what it wrote to stderr."""
        if self._stderr.closed:
            return ""
        # Not by seeking: the process shares the file's position with us and would write over what it said before.
        descriptor = self._stderr.fileno()
        start = max(0, os.fstat(descriptor).st_size - _TAIL)
        return os.pread(descriptor, _TAIL, start).decode(errors="replace").strip()

    def end(self, timeout: float = _END_TIMEOUT) -> None:
        """Asks it to end (SIGTERM), and ends it (SIGKILL) when it has not after `timeout`, [s]. May be called twice."""
        if self._stderr.closed:
            return
        if not self._process.terminate(timeout):
            self.kill()
        self._process.close()
        os.close(self._stdout)
        self._stderr.close()

    def kill(self) -> None:
        """Ends it at once and waits until it is gone."""
        self._process.kill()

    def wait(self, timeout: float) -> bool:
        """Returns whether it has ended within `timeout`, [s]."""
        return self._process.wait(timeout)

    def read_output(self) -> str:
        """Returns what has come on stdout since the last call; does not wait."""
        if not select.select([self._stdout], [], [], 0.0)[0]:
            return ""
        return os.read(self._stdout, 4096).decode(errors="replace")


def _here() -> str | None:
    try:
        return os.getcwd()
    except FileNotFoundError:  # The folder has been removed.
        return None


def parent_pid() -> int:
    """Returns the process id of what our processes' parent is: it is gone when we are.

    Raises:
        ConnectionLostError: It could not be started.
    """
    try:
        return fork_server().pid
    except OSError as error:
        raise ConnectionLostError(f"Python could not be started once more: {error}").coded("no_process") from error


class VirtualController(ManagedProcess):
    """A private `rcilab controller` on loopback and free ports; it ends with this process, whatever happens to it.

    Args:
        model_name: Name of the arm.
        plant: "ideal" or "mujoco".
        lockstep: Whether a simulated millisecond waits for its command.
        options: Further options of `rcilab controller`.
    """

    def __init__(
        self, model_name: str, plant: str = "ideal", lockstep: bool = False, options: Sequence[str] = ()
    ) -> None:
        arguments = ["controller", "--model", model_name, "--plant", plant, "--port", "0", *options]
        if lockstep:
            arguments.append("--lockstep")
        super().__init__("rcilab.cli", [*arguments, "--exit-with-parent", str(parent_pid())], "the virtual controller")
        self._said = ""
        self._started = time.monotonic()
        self._address: str | None = None

    @property
    def address(self) -> str | None:
        """Where it listens, or None as long as it does not.

        Raises:
            ConnectionLostError: It has ended, or has not been ready for too long; the message carries what it said.
        """
        if self._address is None:
            is_alive = self.is_alive
            self._said += self.read_output()
            for line in self._said.splitlines(keepends=True):
                found = _LISTENING.match(line)
                if found and line.endswith("\n"):
                    self._address = found[1]
                    return self._address
            if not is_alive:
                words = self.last_words or "it said nothing"
                raise ConnectionLostError(f"{self.name} did not start ({self.how_it_ended}): {words}").coded(
                    "no_process"
                )
            if time.monotonic() - self._started > START_TIMEOUT:
                raise ConnectionLostError(
                    f"{self.name} was not ready after {START_TIMEOUT:g} s: {self.last_words or 'it said nothing'}; "
                    "try again when the machine is less busy"
                ).coded("slow_start", seconds=f"{START_TIMEOUT:g}")
        return self._address

    @property
    def world_address(self) -> str | None:
        """Where its world port is, as HOST:PORT, once it listens; None: it has none."""
        found = _WORLD.search(self._said)
        return found[1] if found else None


def start_controller(
    model_name: str, plant: str = "ideal", lockstep: bool = False, options: Sequence[str] = ()
) -> VirtualController:
    """Returns a private virtual controller that is ready for a client.

    Args:
        model_name: Name of the arm.
        plant: "ideal" or "mujoco".
        lockstep: Whether a simulated millisecond waits for its command.
        options: Further options of `rcilab controller`.

    Raises:
        ConnectionLostError: It did not start; the message carries what it said.
    """
    controller = VirtualController(model_name, plant, lockstep, options)
    try:
        while controller.address is None:
            time.sleep(0.01)
    except BaseException:
        controller.end()
        raise
    return controller
