"""The bench of the loop stays at the controls however busy the machine is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcilab.control_process import SupervisorStatus
from rcilab.control_process.layout import OPERATOR_TIMEOUT
from rcilab.core.cycle_log import cycle_dtype
from rcilab.diagnostics.bench import loop
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")


class Impatient:
    """A supervisor that refuses a motion when nobody has been at the controls for too long, by a clock of its own."""

    def __init__(self) -> None:
        self.now = self.heard = 0.0
        self.executed = 0

    def set_operator_present(self, present: bool) -> None:
        self.heard = self.now

    def execute(self, motion: object, certificate: object) -> Any:
        assert self.now - self.heard <= OPERATOR_TIMEOUT, "nobody is at the controls"
        self.executed += 1
        return SimpleNamespace(done=True, wait=lambda timeout: None)

    def status(self) -> SupervisorStatus:
        return SupervisorStatus(phase="idle", q_c=MODEL.home)

    def reconnect(self) -> Any:
        return SimpleNamespace(wait=lambda timeout: None)

    power_on = reconnect

    def open_reader(self) -> Any:
        return SimpleNamespace(drain=lambda: np.zeros(0, cycle_dtype(7)))


def test_a_watch_that_is_long_in_coming_leaves_the_controls_in_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = Impatient()

    class SlowWatch:
        def __enter__(self) -> SlowWatch:
            supervisor.now += 2.0 * OPERATOR_TIMEOUT
            return self

        def __exit__(self, *_: object) -> None: ...

    monkeypatch.setattr(loop, "CpuStallMonitor", SlowWatch)
    bench: Any = SimpleNamespace(
        store=SimpleNamespace(state=SimpleNamespace(model=MODEL)), server=SimpleNamespace(get_clients=dict)
    )
    loop.stream(bench, supervisor, 0.5)  # pyright: ignore[reportArgumentType]
    assert supervisor.executed == 1
