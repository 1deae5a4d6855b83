"""Before the workbench opens: the addresses it may listen on, and the errors if that is not possible.

Access to the open page is controlled by `rcilab.views.access_control`.
"""

from __future__ import annotations

import errno
import resource
import socket

from rcilab.core.errors import UsageError
from rcilab.makers.driver import parse_address
from rcilab.makers.maker import require_feature
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.workbench.access import is_local, require_token

DEFAULT_PORT = 8080
_FILES = 48  # Open files: 22 with an idle arm, three more per page. A tuning value.


def check_host(host: str, token: str | None) -> None:
    """Raises UsageError if other machines can reach the address without a token, or with too short a one."""
    if token is not None:
        require_token(token, "WorkbenchConfig")
    elif not is_local(host):
        raise UsageError(
            f"host {host} opens the workbench to the network, and anyone who opens the page can move the robot; "
            "give a token, or leave the host away to stay on this machine"
        )


def require_openable(host: str, token: str | None, target: str, model: str) -> RobotModel:
    """Returns the model to open with; reports errors that can be known before anything slow is loaded.

    Args:
        host: Address to listen on.
        token: Secret that every page must send.
        target: "virtual", or the address of a controller.
        model: Name of the arm.

    Raises:
        ModelError: No robot has this name, or it cannot be driven at an address.
        UsageError: The address needs a token, or the controller's is not valid.
    """
    check_host(host, token)
    _require_files()
    opened = load_model(model)
    if target == "virtual":
        return opened  # Without a virtual controller it opens in preview.
    parse_address(target, opened)
    return require_feature(opened, "driving")


def _require_files() -> None:
    """Raises the limit of open files to what the page may need; an error if that is not possible."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < _FILES:
        if hard != resource.RLIM_INFINITY and hard < _FILES:
            raise UsageError(f"only {hard} files may be open, the page needs {_FILES}: run `ulimit -n {_FILES}` before")
        resource.setrlimit(resource.RLIMIT_NOFILE, (_FILES, hard))


def bind(host: str, port: int, token: str | None = None) -> socket.socket:
    """Returns a listening socket on exactly this port; port 0 takes any free one.

    A name may resolve to another address than when it was checked: the address of the socket counts.

    Raises:
        UsageError: The port is taken, or the address is not ours or needs a token; the message says what to change.
    """
    from rcilab.views.viser_server import listen

    try:
        bound = listen(host, port)
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
    try:
        check_host(bound.getsockname()[0], token)
    except UsageError:
        bound.close()
        raise
    return bound
