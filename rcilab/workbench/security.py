"""The front door of the workbench: which address it may be opened on, and what to say when that does not work.

Who may come in through it is decided by `rcilab.views.gate`.
"""

from __future__ import annotations

import errno
import socket

from rcilab.errors import UsageError
from rcilab.model import RobotModel, load_model, require_rci
from rcilab.views.gate import is_loopback

DEFAULT_PORT = 8080


def check_host(host: str, token: str | None) -> None:
    """Raises UsageError when the address is open to others and no token guards it."""
    if not is_loopback(host) and not token:
        raise UsageError(
            f"--host {host} opens the workbench to the network, and whoever opens the page can move the robot; "
            "add --token SECRET, or leave --host away to stay on this machine"
        )


def require_openable(host: str, token: str | None, target: str, model: str) -> RobotModel:
    """Returns the arm to open with; refuses what can be known to fail before anything is loaded that takes time.

    Args:
        host: Address to listen on.
        token: Secret that every page must bring.
        target: "virtual", or the address of a controller.
        model: Name of the arm.

    Raises:
        ModelError: No robot has this name, or it does not speak the RCI.
        UsageError: The address needs a token, or the controller's is none.
    """
    check_host(host, token)
    if target != "virtual":
        from rcilab.client.address import parse_address

        parse_address(target)
    return require_rci(load_model(model))


def bind(host: str, port: int) -> socket.socket:
    """Returns a listening socket on exactly this port; port 0 takes any free one.

    Raises:
        UsageError: The port is taken or the address is not ours; the message says what to change.
    """
    from rcilab.views.guarded_server import listen

    try:
        return listen(host, port)
    except socket.gaierror as error:
        raise UsageError(f"--host {host} is not an address of this machine; leave it away for 127.0.0.1") from error
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            other = port + 1 if port < 65535 else 0
            raise UsageError(
                f"port {port} is in use, perhaps by another workbench: close that one, or start this one with "
                f"`rcilab --port {other}`"
            ) from error
        raise UsageError(
            f"cannot listen on {host} port {port} ({error.strerror}): choose another with --port or --host"
        ) from error
