"""A controller and a client of a user who may not open port 502, in a temporary folder of their own."""

from __future__ import annotations

from rcilab.makers.ufactory.wire.unix_sockets import unix_socket_path
from tests.makers.ufactory.clients.conftest import run_program
from tests.peers.arena import Process


def main() -> None:
    """Raises an error if a client does not reach the controller, or if it leaves a socket."""
    folder = unix_socket_path(502).parent
    with Process("--host", "127.0.0.9", "--port", "502", model="xArm6"):
        assert len(list(folder.glob("xarmcontroller_uds_*"))) == 5
        code, angles, has_reports = run_program(folder, "by_unix_socket", "127.0.0.1")
        assert (code, has_reports) == (0, True)
        assert max(abs(angle - 0.1) for angle in angles) < 1e-4
    assert not list(folder.glob("xarmcontroller_uds_*"))


if __name__ == "__main__":
    main()
