"""Named poses: those of the arm, and those stored by the operator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from rcilab.app.arm_features import has_zero_pose
from rcilab.app.goal.goal_actions import PoseGoal
from rcilab.app.goal.named_pose_actions import NamedPose
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, BoundControl, PageText

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_Name = Literal["zero", "home", "here", "undo"]
_NAMES: tuple[_Name, ...] = ("zero", "home", "here", "undo")
_What = Literal["recall", "delete"]
_ACTS: tuple[_What, ...] = ("recall", "delete")


class PosesPanel:
    """A group of the Jog tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("jog.poses")):
            gui.add_html('<i class="rl-poses"></i>')
            shown: list[_Name] = [name for name in _NAMES if name != "zero" or has_zero_pose(state.model)]
            names: dict[str, _Name] = {text(f"jog.{name}"): name for name in shown}
            named = gui.add_button_group(" ", list(names))

            @named.on_click
            async def _(event: Any) -> None:
                ask(PoseGoal(page=event.client_id, name=names[event.target.value]))

            self._nothing = text("poses.nothing")
            chosen = gui.add_dropdown(
                text("poses.stored_ones"), self._options(state), initial_value=self._chosen(state)
            )
            self._pose = BoundControl(chosen, ask, lambda v, p: NamedPose(page=p, what="choose", name=v))
            acts = gui.add_button_group("  ", [text(f"poses.{act}") for act in _ACTS], hint=text("poses.recall_hint"))
            whats: dict[str, _What] = {text(f"poses.{act}"): act for act in _ACTS}

            @acts.on_click
            async def _(event: Any) -> None:
                what = whats[event.target.value]
                ask(NamedPose(page=event.client_id, what=what, name=self._shown.jog.pose))

            self._name = PageText(gui.add_text(text("poses.name"), "", hint=text("poses.store_hint")))
            store = gui.add_button_group("   ", [text("poses.store")], hint=text("poses.store_hint"))

            @store.on_click
            async def _(event: Any) -> None:
                ask(NamedPose(page=event.client_id, what="store", name=self._name.of(event.client_id)))

        self._shown = state

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the list."""
        if state.jog.poses != self._shown.jog.poses:
            self._pose.exchange(self._options(state), self._chosen(state))
            if set(state.jog.poses) > set(self._shown.jog.poses):
                self._name.handle.value = ""
        self._name.show(state.control_lock, "")
        self._shown = state
        self._pose.show(self._chosen(state))

    def _options(self, state: UiState) -> tuple[str, ...]:
        return state.jog.poses or (self._nothing,)

    def _chosen(self, state: UiState) -> str:
        return state.jog.pose or self._nothing
