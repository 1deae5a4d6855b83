"""Cost of showing the position of the arm on a page."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version

import numpy as np

from rcilab.core.errors import ConnectionLostError
from rcilab.diagnostics.bench.empty_page import bare_page
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene

_ROBOT = "xMatePro7"
_RATE = 60.0  # [Hz]
_PART = 1.5  # [s] Standstill and motion alternate, so that other load on the machine affects both.
_PARTS = 6
_PAGE = """
import sys
from websockets.sync.client import connect
url, protocol = sys.argv[1:]
with connect("ws" + url[4:], origin=url.rstrip("/"), subprotocols=[protocol], max_size=None) as link:
    link.recv()
    print("connected", flush=True)
    for _ in link:
        pass
"""
"""A client that receives everything and draws nothing, in its own process, so that only the mirroring is measured."""


def bench_mirror() -> Measurement:
    """Processor time per second of this process for updating the arm on one page at 60 Hz."""
    model = load_model(_ROBOT)
    poses = model.home + 0.3 * np.sin(0.1 * np.arange(int(_RATE * _PART))[:, np.newaxis] + np.arange(model.n))
    with bare_page() as (server, url):
        arm = ArmView(ViserScene(server), "live", model)
        with _receiving(url):
            costs: list[float] = []
            for _ in range(_PARTS):
                idle, moving = _processor_time(lambda step: None), _processor_time(lambda step: arm.show(poses[step]))
                costs.append(max(moving - idle, 0.0) / _PART)
    note = f"{_RATE:.0f} poses per second of an {_ROBOT}, one page connected; 50 ms per second are 5 % of a core"
    return summarise("mirror", costs, "ms", 50.0, note)


@contextmanager
def _receiving(url: str) -> Iterator[None]:
    """Keeps a client connected that receives the messages of a page."""
    command = [sys.executable, "-c", _PAGE, url, f"viser-v{version('viser')}"]
    page = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert page.stdout is not None
        if not page.stdout.readline():
            raise ConnectionLostError("bench: the page could not be connected to")
        yield
    finally:
        page.kill()
        page.communicate()


def _processor_time(act: Callable[[int], None]) -> float:
    before, start = time.process_time(), time.monotonic()
    for step in range(int(_RATE * _PART)):
        act(step)
        time.sleep(max(0.0, start + (step + 1) / _RATE - time.monotonic()))
    return time.process_time() - before
