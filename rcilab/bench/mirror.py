"""What it costs to let the page show where the arm is."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
from websockets.sync.client import connect

from rcilab.bench.bare import bare_page
from rcilab.bench.measure import Measurement, summarise
from rcilab.model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene

_ROBOT = "xMatePro7"
_RATE = 60.0  # [Hz]
_PART = 1.5  # [s] of standing still and of moving, by turns: what else the machine does burdens both alike.
_PARTS = 6


def bench_mirror() -> Measurement:
    """What it costs this process, in processor time a second, to keep the arm on one page at 60 Hz."""
    model = load_model(_ROBOT)
    poses = model.home + 0.3 * np.sin(0.1 * np.arange(int(_RATE * _PART))[:, np.newaxis] + np.arange(model.n))
    with bare_page() as (server, url):
        arm = ArmView(ViserScene(server), "live", model)
        protocol: Any = [f"viser-v{version('viser')}"]
        origin = {"Origin": url.rstrip("/")}
        link = connect(url.replace("http", "ws"), additional_headers=origin, subprotocols=protocol, max_size=None)
        with link:
            link.recv(timeout=10.0)
            costs: list[float] = []
            for _ in range(_PARTS):
                idle, moving = _processor_time(lambda step: None), _processor_time(lambda step: arm.show(poses[step]))
                costs.append(max(moving - idle, 0.0) / _PART)
    note = f"{_RATE:.0f} poses a second of an {_ROBOT}, one page connected; 50 ms a second are 5 % of a core"
    return summarise("mirror", costs, "ms", 50.0, note)


def _processor_time(act: Callable[[int], None]) -> float:
    before, start = time.process_time(), time.monotonic()
    for step in range(int(_RATE * _PART)):
        act(step)
        time.sleep(max(0.0, start + (step + 1) / _RATE - time.monotonic()))
    return time.process_time() - before
