"""What an arm lacks is off on the page and in the notebook, field by field, with the reason beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import ipywidgets
import pytest

from rcilab.app.arm_features import explain_missing_feature, explain_missing_part
from rcilab.app.goal.goal import goal_at
from rcilab.app.request import TypeField
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.setup.setup_actions import PressSetup, SetSetup, SetupActions
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import ModelError
from rcilab.i18n.translator import Text as NotebookText
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.maker import maker_of, require_parts
from rcilab.model.robot_model import load_model
from rcilab.notebook.limit_fields import LimitFields
from rcilab.notebook.signal_fields import SignalFields
from rcilab.workbench.panels.mode import ModePanel
from rcilab.workbench.panels.setup import SetupPanel
from rcilab.workbench.panels.setup_numbers import SetupNumbersPanel
from rcilab.workbench.panels.signals import SignalsPanel, levels_html
from rcilab.workbench.panels.soft_limits import SoftLimitsPanel

MODEL = load_model("xMate3")
READY = SupervisorStatus(phase="idle", code="idle", world_address="127.0.0.1:1")


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    maker = maker_of(MODEL)
    assert maker is not None

    def lack(**changes: object) -> None:
        monkeypatch.setattr(type(maker), "capabilities", replace(maker.capabilities, **changes))

    return lack


@pytest.fixture
def store() -> Store:
    return Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home)))


def gui() -> MagicMock:
    """A page whose every control is another object."""

    def build(*_: object, **__: object) -> MagicMock:
        return MagicMock(value="")

    names = ("add_text", "add_button", "add_checkbox", "add_dropdown", "add_html", "add_folder")
    return MagicMock(**{f"{name}.side_effect": build for name in names})


def disabled(handle: Any) -> bool:
    return handle.disabled is True


def test_the_parts_that_are_lacking_are_off_on_the_setup_tab_and_the_others_are_not(lacking, store) -> None:
    lacking(setup=("tool", "load", "control"))
    panel, text = SetupNumbersPanel(Text("en"), lambda request: None), Text("en")
    panel.build(gui(), store.state)
    panel.show(store.state, READY)
    for part, is_off in {"box": True, "force": True, "tool": False, "load": False}.items():
        assert {disabled(field._handle) for field in panel._fields[part]} == {is_off}
        assert disabled(panel._seen[part].handle) is is_off
        lack = explain_missing_part(MODEL, part)
        assert panel._missing[part]._shown == (
            "" if lack is None else f'<p class="rl-note rl-why">{text.render(lack)}</p>'
        )
    assert disabled(panel._active.handle)
    assert disabled(panel._axes.handle)
    table = SetupPanel(text, lambda request: None)._table_html(store.state, READY)
    assert "The controller of xMate3 has no safety box." in table
    assert "The controller of xMate3 has no tool." not in table


def test_soft_limits_mode_parameters_and_signals_are_off_one_by_one(lacking, store) -> None:
    text = Text("zh")
    limits, mode, signals = (panel(text, lambda request: None) for panel in (SoftLimitsPanel, ModePanel, SignalsPanel))
    for panel in (limits, mode, signals):
        panel.build(gui(), store.state)
        panel.show(store.state, READY)
    assert not any(disabled(field._handle) for _, _, field in limits._fields)
    assert not disabled(mode._reset)
    assert not disabled(signals._reboot)
    lacking(setup=("tool",), outputs=(), inputs=(), reboots=False)
    for panel in (limits, mode, signals):
        panel.show(store.state, READY)
    assert all(disabled(field._handle) for _, _, field in limits._fields)
    assert disabled(limits._whole)
    assert disabled(limits._auto.handle)
    assert disabled(mode._reset)
    assert all(disabled(control) for control in (*signals._buttons, signals._output, signals._reboot))
    shown = [limits._missing, mode._missing, signals._missing, signals._reboot_missing]
    for html, feature in zip(shown, ("joints", "control", "signals", "reboot"), strict=True):
        lack = explain_missing_feature(MODEL, feature)  # type: ignore[arg-type]
        assert lack is not None
        assert text.render(lack) in html._shown


def test_the_signals_are_those_of_the_maker(lacking) -> None:
    lacking(outputs=("CO0",), inputs=("CI0", "CI1"))
    status = replace(READY, outputs=(True,), inputs=(False, True))
    shown = levels_html(MODEL, status, Text("en"))
    assert "<tr><th>CO0</th><td>On</td><th>CI0</th><td>Off</td></tr>" in shown
    assert "<tr><th></th><td>—</td><th>CI1</th><td>On</td></tr>" in shown


def test_a_part_that_is_lacking_cannot_be_edited_restored_or_sent(lacking, store) -> None:
    lacking(setup=("tool", "load"))
    actions = SetupActions(store, SimpleNamespace(status=lambda: READY))
    before = store.state.setup.wanted
    assert before.box is not None
    actions.set_setup(SetSetup(name="edited", value="box"))
    assert "box" not in store.state.setup.seen  # It has no handles in the scene.
    actions.set_setup(SetSetup(name="active", value=True))
    actions.set_setup(SetSetup(name="box", value=True))
    actions.press(PressSetup(what="whole"))
    actions.type_field(TypeField(field="setup.box.xmax", text="500"))
    actions.type_field(TypeField(field="setup.joints.lower.0", text="-90"))
    assert set(store.state.problems) == {"setup.box.xmax", "setup.joints.lower.0"}
    actions.restore(RobotConfiguration(box=before.box, tool=MODEL.T_flange_tool))
    setup = store.state.setup
    assert setup.touched == {"tool"}
    assert setup.seen == {"tool"}
    assert (setup.wanted.box, setup.wanted.force) == (before.box, before.force)
    assert pending_parts(store.state, READY) == ("tool",)
    with pytest.raises(ModelError, match="xMate3 has no soft joint limits"):
        require_parts(MODEL, RobotConfiguration(joints=SoftJointLimits(lower=(0.0,), upper=(1.0,))))


def test_an_arm_that_is_only_planned_for_keeps_its_setup(store, only_planned) -> None:
    panda = load_model(only_planned)
    for part in ("box", "tool", "load", "joints"):
        assert explain_missing_part(panda, part) is None


def test_in_the_notebook_signals_restart_and_soft_limits_are_off(lacking) -> None:
    lacking(setup=("tool",), outputs=(), inputs=(), reboots=False)
    text = NotebookText("en", "rcilab.notebook")
    signals = SignalFields(MODEL, text, MagicMock(), lambda *_, **__: ipywidgets.Button())
    signals.show(READY)
    assert all(control.disabled for control in (signals.on, signals.off, signals.read, signals.output, signals.reboot))
    assert "The controller of xMate3 has no digital signals." in signals._missing.value
    assert "The controller of xMate3 has no restart on request." in signals._reboot_missing.value
    state = SimpleNamespace(model=MODEL, status=READY, robot=None, now=SimpleNamespace(is_virtual=True))
    limits = LimitFields(state, text, MagicMock(), MagicMock(), lambda *_, **__: ipywidgets.Button())
    limits.folder.selected_index = 0
    assert limits.fields
    assert all(field.box.disabled for ends in limits.fields for field in ends)
    assert limits.send.disabled
    assert "The controller of xMate3 has no soft joint limits." in limits._missing.value
