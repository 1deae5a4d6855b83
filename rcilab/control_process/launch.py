"""Start of a private virtual controller in a separate process."""

from __future__ import annotations

import random
import re
import socket
import time
from collections.abc import Sequence

from rcilab.control_process.managed_process import ManagedProcess, parent_pid
from rcilab.core.errors import ConnectionLostError
from rcilab.makers.maker import find_maker

START_TIMEOUT = (
    20.0  # [s] Python with its numerical libraries takes about 1 s from a cold disk; more on a busy machine.
)
_LISTENING = re.compile(r"^listening ([a-z]+://\S+)( |$)")
_WORLD = re.compile(r"^world (\S+)$", re.MULTILINE)


class VirtualController(ManagedProcess):
    """A private `rcilab controller` on loopback and free ports; it ends with this process, even after a crash.

    If the clients of its maker insist on a port, it has an address of its own on loopback.

    Args:
        model_name: Name of the arm.
        plant: "ideal" or "mujoco".
        lockstep: Whether a simulated millisecond waits for its command.
        options: Further options of `rcilab controller`.
    """

    def __init__(
        self, model_name: str, plant: str = "ideal", lockstep: bool = False, options: Sequence[str] = ()
    ) -> None:
        maker = find_maker(model_name)
        port = None if maker is None else maker.client_port
        place = ["--port", "0"] if port is None else ["--host", _find_free_address(port)]
        arguments = ["controller", "--model", model_name, "--plant", plant, *place, *options]
        if lockstep:
            arguments.append("--lockstep")
        super().__init__("rcilab.cli", [*arguments, "--exit-with-parent", str(parent_pid())], "the virtual controller")
        self._output = ""
        self._started = time.monotonic()
        self._address: str | None = None

    @property
    def address(self) -> str | None:
        """Address at which it listens, or None before that.

        Raises:
            ConnectionLostError: It has ended, or was not ready in time; the message contains its output.
        """
        if self._address is None:
            is_alive = self.is_alive
            self._output += self.read_output()
            for line in self._output.splitlines(keepends=True):
                found = _LISTENING.match(line)
                if found and line.endswith("\n"):
                    self._address = found[1]
                    return self._address
            if not is_alive:
                output = self.stderr_tail or "it printed nothing"
                raise ConnectionLostError(f"{self.name} did not start ({self.exit_description}): {output}").coded(
                    "no_process"
                )
            if time.monotonic() - self._started > START_TIMEOUT:
                raise ConnectionLostError(
                    f"{self.name} was not ready after {START_TIMEOUT:g} s: {self.stderr_tail or 'it printed nothing'}; "
                    "try again when the machine is less busy"
                ).coded("slow_start", seconds=f"{START_TIMEOUT:g}")
        return self._address

    @property
    def world_address(self) -> str | None:
        """Address of its simulation port, HOST:PORT; None before it listens and without a simulation port."""
        found = _WORLD.search(self._output)
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
        ConnectionLostError: It did not start; the message contains its output.
    """
    controller = VirtualController(model_name, plant, lockstep, options)
    try:
        while controller.address is None:
            time.sleep(0.01)
    except BaseException:
        controller.end()
        raise
    return controller


def _find_free_address(port: int) -> str:
    """Returns a loopback address at which a TCP port is free; any of 127/8 is this machine."""
    choice = random.SystemRandom()
    while True:
        host = ".".join(["127", *(str(choice.randrange(1, 255)) for _ in range(3))])
        with socket.socket() as probe:
            try:
                probe.bind((host, port))
            except PermissionError:  # This user may not open it: the controller uses another socket, or reports it.
                pass
            except OSError:  # Taken.
                continue
        return host
