"""A virtual Franka controller for a peer to meet, in a thread of this process and in lock-step."""

from __future__ import annotations

import json
import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tests.peers.arena import Arena, arena
from tests.peers.franka.hand import Hand
from tests.peers.franka.robot import PATIENCE, Robot

MODELS = {5: "Panda", 10: "FR3"}


class FciArena:
    """A running controller of a version.

    Attributes:
        version: Its version of the interface.
        arena: Its thread; see `Arena`.
    """

    def __init__(self, version: int, running: Arena) -> None:
        self.version, self.arena = version, running

    @property
    def controller(self) -> Any:
        """The controller without its sockets; touch it inside `Arena.between` only."""
        return self.arena.cycle

    def between(self, action: Callable[[], object]) -> None:
        """Runs an action in the controller's own thread between two cycles, and waits for it."""
        done = threading.Event()

        def act(_: object) -> None:
            action()
            done.set()

        self.arena.between(act)
        assert done.wait(PATIENCE)

    def connect(self, **options: Any) -> Robot:
        """Returns a connected client of this version."""
        return Robot(self.arena.host, self.arena.port, self.version, **options)

    @property
    def hand_port(self) -> int:
        """TCP port of the hand."""
        found = re.search(r"hand_port=(\d+)", self.arena.server.url)
        assert found
        return int(found[1])

    def connect_hand(self, **options: Any) -> Hand:
        """Returns a connected client of the hand."""
        return Hand(self.arena.host, self.hand_port, **options)

    def log(self, *kinds: str) -> list[str]:
        """Returns the texts of the log, of these kinds or all."""
        return [entry.text for entry in self.arena.entries if entry.kind in kinds or not kinds]

    def simulate(self, request: str, **values: Any) -> dict[str, Any]:
        """Sends a request to the simulation port; returns its answer."""
        address = self.arena.server.world_address
        assert address is not None
        host, port = address.split(":")
        with socket.create_connection((host, int(port)), timeout=PATIENCE) as sock:
            sock.sendall(json.dumps({"request": request, **values}).encode() + b"\n")
            with sock.makefile() as lines:
                return json.loads(lines.readline())


@contextmanager
def fci_arena(version: int, **options: Any) -> Iterator[FciArena]:
    """A running `FciArena`."""
    with arena(model=MODELS[version], **options) as running:
        yield FciArena(version, running)
