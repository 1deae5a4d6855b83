"""Sessions with a scripted controller."""

from __future__ import annotations

import pytest

from rcilab.execution.connect import open_session
from tests.execution.peer import MODEL, Peer, Script


@pytest.fixture
def make_robot():
    opened = []

    def make(script: Script | None = None, state_timeout: float = 5.0):
        peer = Peer(script)
        opened.append(peer)
        # As `simulate` does: the peer waits for us, and a busy machine may pause either side.
        robot = open_session(peer.url, MODEL, 1.0, realtime=False, state_timeout=state_timeout)
        opened.append(robot)
        return peer, robot

    yield make
    for thing in reversed(opened):
        thing.close()
