"""The waypoints of the program in the scene: one point each, one label for those close together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.program.program_draft import placed, target_in_base
from rcilab.core.arrays import Array
from rcilab.core.errors import RcilabError

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState

_MOST = 60  # More labels hide the arm, and slow the browser down.
_NEAR = 0.03  # [m] A tuning value: at the home view, two numbers at a smaller distance overlap.
_CHARACTER, _LINE = 0.018, 0.05  # [m] Approximate width and height of a character at the home view.
_RANGES = 2  # A label with more ranges would be wider than its points.
_PLAIN, _CHOSEN, _FAILED = (70, 110, 160), (11, 111, 194), (209, 57, 43)
_SIZE = 0.016  # [m]
_ABOVE = 0.022  # [m]


class ProgramMarks:
    """Draws the program of the state; the selected waypoint and a failed one stand out by colour and sign.

    Args:
        server: The page.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._drawn: tuple[object, ...] = ()
        self._handles: list[Any] = []

    def show(self, state: UiState) -> None:
        """Draws what has changed."""
        program = state.program
        draft = placed(program.draft, state.cell.cell)
        drawn = (draft, program.selected, program.failed, state.model)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        for handle in self._handles:
            handle.remove()
        self._handles = []
        if draft.model != state.model.name:
            return
        points: list[Array] = []
        colors, numbers = [], []
        arm = draft.arm(state.model)
        for number, step in enumerate(draft.steps, start=1):
            try:
                target = target_in_base(step.waypoint, arm)
            except RcilabError:
                continue
            if target is None:
                continue
            failed, chosen = step.key == program.failed, step.key == program.selected
            points.append(target.position)
            colors.append(_FAILED if failed else _CHOSEN if chosen else _PLAIN)
            numbers.append((number, f"{number} !" if failed else f"[{number}]" if chosen else ""))
        for place, (group, sentence) in enumerate(labels_of(points, numbers)):
            self._handles.append(self._label(place, sentence, points[group[0]]))
        if points:
            self._handles.append(
                self._scene.add_point_cloud(
                    "/program/points",
                    np.array(points, dtype=np.float32),
                    np.array(colors, dtype=np.uint8),
                    point_size=_SIZE,
                    point_shape="circle",
                    precision="float32",
                )
            )

    def _label(self, number: int, sentence: str, position: np.ndarray) -> Any:
        x, y, z = (float(value) for value in position)
        return self._scene.add_label(
            f"/program/{number}", sentence, position=(x, y, z + _ABOVE), anchor="bottom-center", depth_test=False,
            font_screen_scale=0.8,
        )  # fmt: skip


def labels_of(points: list[Array], numbers: list[tuple[int, str]]) -> list[tuple[list[int], str]]:
    """Returns the labels of waypoints, which do not overlap at the home view: the points of each, and its text.

    Args:
        points: Their positions, [m].
        numbers: The number of each, ascending, and its own text if it stands out, else "".
    """
    near = _NEAR
    while True:
        groups = neighbours(points, near)
        labels = [(group, label_of([numbers[at] for at in group])) for group in groups[:_MOST]]
        if (
            not _overlap([points[group[0]] for group, _ in labels], [sentence for _, sentence in labels])
            or len(groups) == 1
        ):
            return labels
        near *= 2.0


def _overlap(places: list[Array], sentence: list[str]) -> bool:
    if len(places) < 2:
        return False
    half = 0.5 * _CHARACTER * np.array([len(words) for words in sentence])
    apart = np.array(places)[:, None] - np.array(places)[None]
    beside = np.linalg.norm(apart[..., :2], axis=-1) < half[:, None] + half[None]
    return bool((np.triu(beside, 1) & (np.abs(apart[..., 2]) < _LINE)).any())


def neighbours(points: list[Array], near: float) -> list[list[int]]:
    """Returns the points nearer than `near`, [m], to the first of a group, as indices, group by group."""
    anchors = np.empty((len(points), 3))
    groups: list[list[int]] = []
    for at, point in enumerate(points):
        away = np.linalg.norm(anchors[: len(groups)] - point, axis=1)
        nearest = int(away.argmin()) if len(groups) else 0
        if len(groups) and away[nearest] < near:
            groups[nearest].append(at)
        else:
            anchors[len(groups)] = point
            groups.append([at])
    return groups


def label_of(numbers: list[tuple[int, str]]) -> str:
    """Returns one label for waypoints near each other: their numbers as ranges, and those that stand out.

    Args:
        numbers: The number of each, ascending, and its own text if it stands out, else "".
    """
    if len(numbers) == 1:
        return numbers[0][1] or str(numbers[0][0])
    ranges: list[list[int]] = []
    for number, _ in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    sentence = [f"{low}" if low == high else f"{low}\N{EN DASH}{high}" for low, high in ranges]
    listed = ", ".join(sentence if len(sentence) <= _RANGES else [*sentence[:_RANGES], "\N{HORIZONTAL ELLIPSIS}"])
    return " · ".join([listed, *filter(None, (own for _, own in numbers))])
