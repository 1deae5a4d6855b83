"""The target in the scene: its handles, with its status."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.goal.goal import verdict_lead
from rcilab.app.goal.goal_actions import MoveTarget
from rcilab.app.setup.configuration_state import goal_verdict
from rcilab.app.text import Text
from rcilab.i18n.translator import with_space
from rcilab.workbench.scene.configuration_view import hides_target
from rcilab.workbench.widgets import FAINT, HAND_AWAY, Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState

TONE_COLORS = {"good": (38, 166, 91), "warn": (240, 150, 20), "bad": (214, 48, 38)}
_VIA_COLOR = (11, 111, 194)
_GIZMO_SCALE = 0.26  # [m]
_COLUMNS = 30  # Of a line of the label, at most 208 px: the scene of a narrow window. A Chinese character takes two.
_WIDE = "\u2e80-\u9fff\uff00-\uffef"
_PIECES = re.compile(f"[{_WIDE}][，。；：！？）”%]*|[^\\s{_WIDE}]+|\\s+")  # No line begins with a closing mark.


class GoalView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        state: State with the initial target.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, state: UiState, ask: Ask) -> None:
        pose, scene = state.goal.target, server.scene
        self._tone = self._sentence = ""
        self._via: object = None
        self._target: object = None
        self._touched = float("-inf")
        self._gizmo: Any = scene.add_transform_controls(
            "/target",
            scale=_GIZMO_SCALE,
            line_width=3.0,
            depth_test=False,
            opacity=FAINT,
            wxyz=pose.wxyz,
            position=pose.position,
        )
        self._mark: Any = scene.add_icosphere(
            "/mark", radius=0.028, color=TONE_COLORS["good"], opacity=0.4, cast_shadow=False, receive_shadow=False,
            position=pose.position,
        )  # fmt: skip
        self._label: Any = scene.add_label(
            "/verdict", "", position=_below(pose.position), anchor="top-center", depth_test=False,
            font_screen_scale=1.0,
        )  # fmt: skip
        self._via_mark: Any = scene.add_icosphere(
            "/via", radius=0.018, color=_VIA_COLOR, cast_shadow=False, receive_shadow=False, visible=False
        )
        self._via_label: Any = scene.add_label(
            "/via_label", "", anchor="bottom-center", depth_test=False, font_screen_scale=1.0, visible=False
        )

        @self._gizmo.on_update
        async def _(event: Any) -> None:
            self._touched = time.monotonic()
            ask(
                MoveTarget(
                    page=event.client_id,
                    position=tuple(map(float, event.target.position)),
                    wxyz=tuple(map(float, event.target.wxyz)),
                    ended=event.phase == "end",
                )
            )

    @property
    def is_held(self) -> bool:
        """Whether the handles are being dragged, or have just been."""
        return time.monotonic() - self._touched <= HAND_AWAY

    @property
    def handles(self) -> tuple[str, ...]:
        """The nodes that can be dragged now."""
        return (self._gizmo.name,) if self._gizmo.visible else ()

    def show(self, state: UiState, text: Text, *, is_hidden: bool = False) -> None:
        """Follows the goal, unless the handles are being dragged.

        Args:
            state: State of the page.
            text: Texts.
            is_hidden: Whether the target is not shown unless it is being dragged.
        """
        goal = state.goal
        away = hides_target(state) or (is_hidden and not self.is_held)
        if self._gizmo.visible == away:
            self._gizmo.visible = self._mark.visible = self._label.visible = not away
        if not self.is_held:
            position, wxyz = goal.target.position, goal.target.wxyz
            if np.abs(np.asarray(self._gizmo.position) - position).max() > 1e-7:
                self._gizmo.position = position
            if 1.0 - abs(float(np.asarray(self._gizmo.wxyz) @ wxyz)) > 1e-12:
                self._gizmo.wxyz = wxyz
        if goal.target is not self._target:
            self._target = goal.target
            self._label.position = _below(goal.target.position)
            self._mark.position = goal.target.position
        tone, why = goal_verdict(state)
        if tone != self._tone:
            self._tone = tone
            self._mark.color = TONE_COLORS[self._tone]
        lead = text(verdict_lead(tone, why))
        sentence = text("reach.label") if tone == "good" else "".join(with_space(lead, text.render(why)))
        sentence = folded(text("target.handles", verdict=sentence))
        if sentence != self._sentence:
            self._sentence = sentence
            self._label.text = sentence
        self._show_via(state, text)

    def remove(self) -> None:
        """Removes everything of it from the scene."""
        for handle in (self._gizmo, self._mark, self._label, self._via_mark, self._via_label):
            handle.remove()

    def _show_via(self, state: UiState, text: Text) -> None:
        via, sentence = state.via if state.path_type == "arc" else None, text("target.via_label")
        if sentence != self._via_label.text:
            self._via_label.text = sentence
        if via is self._via:
            return
        self._via = via
        self._via_mark.visible = self._via_label.visible = via is not None
        if via is not None:
            self._via_mark.position = self._via_label.position = via.position


def folded(sentence: str) -> str:
    """Returns a sentence in lines that fit a narrow scene: viser does not break a label."""
    lines, columns = [""], 0
    for piece in _PIECES.findall(sentence):
        width = sum(1 + bool(re.match(f"[{_WIDE}]", letter)) for letter in piece)
        if columns and columns + width > _COLUMNS:
            lines, columns = [*lines, ""], 0
        if columns or not piece.isspace():
            lines[-1] += piece
            columns += width
    return "\n".join(line.rstrip() for line in lines)


def _below(position: np.ndarray) -> tuple[float, float, float]:
    """Returns a position for the label clear of the handles, and of the wrist, which is mostly above."""
    x, y, z = (float(number) for number in position)
    return x, y, z - 1.1 * _GIZMO_SCALE
