"""Outputs, inputs and the restart of the controller, as the page asks for them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.run.signal_actions import PressSignals, SetOutput
from rcilab.app.run.world_actions import SetWiring
from rcilab.app.status_text import describe_status, phase_code
from rcilab.app.text import Text
from rcilab.workbench.app import Workbench
from rcilab.workbench.panels.signals import levels_html
from rcilab.workbench.panels.target_robot import TargetRobotPanel
from tests.workbench.opened import opened, wait


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


def test_an_output_is_set_and_the_input_it_is_wired_to_is_shown(bench: Workbench) -> None:
    ask, status = bench.dispatcher.ask, bench.session.status
    assert status().inputs is None
    assert status().outputs == (None,) * 6
    ask(SetWiring(name="loop_back", on=True))
    ask(SetOutput(signal=2, level=True))
    wait(lambda: status().outputs[2] is True, "the output")
    ask(PressSignals(what="read"))
    wait(lambda: status().inputs == (False, False, True, False, False, False), "the input")
    shown = levels_html(bench.store.state.model, status(), Text("zh"))
    assert "<th>DO0_2</th><td>开</td><th>DI0_2</th><td>开</td>" in shown
    ask(SetWiring(name="loop_back", on=False))
    ask(SetOutput(signal=3, level=True))
    wait(lambda: status().outputs[3] is True, "an output without a wire")
    assert status().inputs[3] is False
    ask(SetWiring(name="loop_back", on=True))
    wait(lambda: status().inputs[3] is True, "the input, read as soon as it is wired")
    for signal in (2, 3):
        ask(SetOutput(signal=signal, level=False))
    wait(lambda: status().outputs[2] is False and status().inputs == (False,) * 6, "the output taken back")


def test_a_restart_is_asked_about_and_ends_the_connection_until_connect(bench: Workbench) -> None:
    ask, status, state = bench.dispatcher.ask, bench.session.status, lambda: bench.store.state
    ask(PressSignals(what="confirm"))  # Nothing was asked: nothing happens.
    ask(PressSignals(what="reboot"))
    wait(lambda: state().reboot_asked, "the question")
    assert status().phase == "idle"
    ask(PressSignals(what="cancel"))
    wait(lambda: not state().reboot_asked, "the question withdrawn")
    ask(SetOutput(signal=0, level=True))
    wait(lambda: status().outputs[0] is True, "an output")
    ask(PressSignals(what="reboot"))
    ask(PressSignals(what="confirm"))
    wait(lambda: status().code == "lost.rebooted", "the end of the connection")
    assert phase_code(status()) == "phase.rebooted"
    assert describe_status(status()).code == "incident.lost.rebooted_virtual"
    panel = next(panel for panel in bench.renderer._panels if isinstance(panel, TargetRobotPanel))
    wait(lambda: 'rl-warn"><b>virtual controller, ideal arm</b> restarting' in panel._where._shown, "no trouble")
    ask(RobotCommand(what="reconnect"))
    wait(lambda: status().phase == "idle", "another connection")
    assert status().outputs == (None,) * 6
    assert status().inputs is None
