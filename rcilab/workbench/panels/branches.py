"""The solutions for the target, one per row; the one under the mouse, or with the focus, is shown in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.goal.goal import NEAR_LIMIT, NO_SOLUTIONS, distinguishing_joints, margin, verdict_lead
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, Html, esc

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class BranchesPanel:
    """A list for mouse and keyboard; `branches.js` sends the chosen row."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text = text
        self._seen: tuple[object, ...] = (None, None, None)

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the list."""
        with gui.add_folder(self._text("target.branches")):
            self._rows = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows goal and arm."""
        here = None if status.q_c is None else np.round(status.q_c, 2)
        seen = (state.goal, state.model, None if here is None else here.tobytes())
        if seen != self._seen:
            self._seen = seen
            self._rows.show(self._html(state, here))

    def _html(self, state: UiState, arm: np.ndarray | None) -> str:
        solutions, text = state.goal.reach.solutions, self._text
        if solutions is None or not len(solutions):
            reach = state.goal.reach
            code = NO_SOLUTIONS.get(verdict_lead(reach.tone, reach.reason), "target.no_branches")
            return f'<p class="rl-note">{esc(text(code))}</p>'
        here = state.goal.q if arm is None else arm
        order = nearest_first(np.asarray(list(solutions)), here)
        joints = distinguishing_joints(np.asarray(list(solutions)))
        rows = "".join(
            self._row(number, at, solutions[at], here, joints, state) for number, at in enumerate(order, start=1)
        )
        heads = "".join(
            f"<span>{esc(text(f'target.head.{name}'))}</span>" for name in ("number", "margin", "worst", "away")
        )
        others = len(solutions.all) - len(solutions)
        rest = f'<p class="rl-note rl-dim">{esc(text("target.forbidden", count=others))}</p>' if others else ""
        return (
            f'<div class="rl-branch-head" aria-hidden="true">{heads}</div>'
            f'<div class="rl-branches" role="listbox" aria-label="{esc(text("target.branches"))}">{rows}</div>'
            f'<p class="rl-note rl-dim">{esc(text("target.branch_point"))}</p>{rest}'
        )

    def _row(
        self, number: int, at: int, q: np.ndarray, here: np.ndarray, joints: tuple[int, ...], state: UiState
    ) -> str:
        least = margin(state.model, q)
        chosen = float(np.abs(np.angle(np.exp(1j * (q - state.goal.q)))).max()) < 1e-6
        left, away = (self._text.units.format_angle(a, 0) for a in (least.angle, float(np.abs(q - here).max())))
        sign = "▲ " if least.angle < NEAR_LIMIT else ""
        cells = (f"{number}", f"{sign}{left}", f"J{least.joint}", away)
        angles = " · ".join(f"J{j + 1} {self._text.units.format_angle(float(q[j]), 0)}" for j in joints)
        sentence = self._text("target.branch_said", number=cells[0], margin=cells[1], joint=cells[2], away=cells[3])
        sentence += f": {angles}" if angles else ""
        return (
            f'<div class="rl-branch" role="option" tabindex="{0 if chosen or number == 1 else -1}" '
            f'data-branch="{at}" aria-selected="{str(chosen).lower()}" aria-label="{esc(sentence)}">'
            + "".join(f"<span>{esc(cell)}</span>" for cell in cells)
            + (f"<small>{esc(angles)}</small></div>" if angles else "</div>")
        )


def nearest_first(solutions: np.ndarray, here: np.ndarray) -> list[int]:
    """Returns the order of the solutions in the list: by the largest angle that a joint has to move.

    Args:
        solutions: Joint angles, shape (N, n), [rad].
        here: Position of the arm, shape (n,), [rad].
    """
    away = np.abs(solutions - here).max(axis=1)
    return sorted(range(len(solutions)), key=lambda at: (round(float(away[at]), 3), at))
