"""Ten minutes of servo targets at 250 Hz to an xArm6, by the maker's client library."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from rcilab.control_process.launch import _find_free_address
from tests.makers.ufactory.clients.conftest import PATIENCE, PORT, run_program
from tests.peers.arena import PLANTS, Process
from tests.peers.endurance import GROWTH

pytestmark = pytest.mark.endurance

SECONDS, WARM_UP = 600.0, 60.0  # [s]
REPORT_RATE = 5.0  # [Hz]


@pytest.mark.parametrize("plant", PLANTS)
def test_ten_minutes_of_servo_lose_nothing_and_leave_memory_flat(plant: str, tmp_path: Path) -> None:
    pytest.importorskip("xarm")
    arguments = ("--host", _find_free_address(PORT), "--port", str(PORT), "--plant", plant)
    with Process(*arguments, model="xArm6") as controller:
        memory: list[int] = []
        timer = threading.Timer(WARM_UP, lambda: memory.append(controller.memory()))
        timer.start()
        found = run_program(tmp_path, "swing", controller.host, SECONDS, timeout=SECONDS + PATIENCE)
        timer.join()
        grown = controller.memory() - memory[0]
    assert found["codes"] == [0]
    assert found["sent"] > 0.99 * 250.0 * SECONDS
    assert found["reports"] > 0.99 * REPORT_RATE * SECONDS
    np.testing.assert_allclose(found["end"], found["start"], atol=1e-3)
    assert grown < GROWTH, f"the controller grew by {grown} bytes"
