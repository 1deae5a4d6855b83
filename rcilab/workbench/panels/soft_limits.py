"""Soft joint limits, and whether the virtual controller stops commands at them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import explain_missing_part
from rcilab.app.run.drive_state import is_ours
from rcilab.app.run.world_actions import SetWiring
from rcilab.app.setup.configuration_state import own_limits, soft_limits
from rcilab.app.setup.setup_actions import PressSetup
from rcilab.app.setup.setup_fields import JOINT_ENDS
from rcilab.app.text import Text
from rcilab.makers.maker import capabilities_of
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class SoftLimitsPanel:
    """Two groups of the Setup tab: two numbers per joint, and where it can be chosen, the behaviour at the limits."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._has_limits = explain_missing_part(state.model, "joints") is None
        if not self._has_limits:
            return
        self._fields: list[tuple[str, int, NumberField]] = []
        self._named: list[tuple[str, str]] = []
        with gui.add_folder(text("softlimits.title"), expand_by_default=False):
            self._problems = Html(gui)  # Above the fields: fourteen of them hide what is below.
            gui.add_html('<i class="rl-pairs"></i>')
            for joint in range(state.model.n):
                for end in JOINT_ENDS:
                    label, field = text(f"softlimits.{end}", joint=joint + 1), f"setup.joints.{end}.{joint}"
                    box = gui.add_text(label, "", hint=text("softlimits.hint"))
                    self._fields.append((end, joint, NumberField(box, ask, field, text.unit("deg"))))
                    self._named.append((field, label))
            self._whole = gui.add_button(text("softlimits.whole"), icon="restore", color="gray")
            on_press(self._whole, ask, lambda page: PressSetup(page=page, what="whole"))
        self._has_auto = "auto_limit" in capabilities_of(state.model).options
        if not self._has_auto:
            return
        with gui.add_folder(text("softlimits.beyond"), expand_by_default=False):
            auto = gui.add_checkbox(text("softlimits.auto"), False, hint=text("softlimits.auto_hint"))
            self._auto = BoundControl(auto, ask, lambda v, p: SetWiring(page=p, name="auto_limit", on=bool(v)))
            gui.add_html(f'<p class="rl-note">{esc(text("softlimits.note"))}</p>')

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the configuration."""
        if not self._has_limits:
            return
        limits, is_fixed = soft_limits(state), bool(state.watched)
        for end, joint, field in self._fields:
            field.disable(is_fixed)
            number = shown(math.degrees(getattr(limits, end)[joint]))
            field.show(number, state.problems.get(field.field), state.entered)
        self._problems.show(problems_html(state, self._text, self._named))
        self._whole.disabled = limits == own_limits(state) or is_fixed
        if not self._has_auto:
            return
        self._auto.show(state.world.auto_limit)
        self._auto.handle.disabled = not is_ours(status)
