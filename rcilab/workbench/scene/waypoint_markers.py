"""The waypoints of the program in the scene: one point each, one label for those close together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.program.program_draft import placed, target_in_base
from rcilab.app.text import Text
from rcilab.core.arrays import Array
from rcilab.core.errors import RcilabError

if TYPE_CHECKING:
    import viser

    from rcilab.app.program.program_draft import Draft
    from rcilab.app.store import UiState
    from rcilab.model.robot_model import RobotModel

_MOST = 60  # More labels hide the arm, and slow the browser down.
_NEAR = 0.03  # [m] A tuning value: at the home view, two numbers at a smaller distance overlap.
_CHARACTER, _LINE = 0.018, 0.05  # [m] Approximate width and height of a character at the home view.
_RANGES = 2  # A label with more ranges would be wider than its points.
_PLAIN, _CHOSEN, _FAILED = (70, 110, 160), (11, 111, 194), (209, 57, 43)
_SIZE, _LARGER = 0.016, 0.02  # [m] Of a point, and of one that stands out, which covers it.
_ABOVE = 0.022  # [m]


class ProgramMarks:
    """Draws the program of the state; the selected waypoint and a failed one stand out by colour and text.

    Args:
        server: The page.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._drawn: tuple[object, ...] = ()
        self._points: dict[int, tuple[int, Array]] = {}  # Number and position of each waypoint, by key.
        self._placed: tuple[object, object] = (None, None)
        self._clouds: list[Any] = []
        self._labels: list[Any] = []

    def show(self, state: UiState, text: Text) -> None:
        """Draws what has changed."""
        program = state.program
        draft = placed(program.draft, state.cell.cell)
        drawn = (draft, program.selected, program.failed, state.model, text.language)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        is_moved = self._placed[0] is not draft or self._placed[1] is not state.model
        if is_moved:
            self._placed = draft, state.model
            self._points = _positions(draft, state.model)
        special = {
            key: color
            for key, color in ((program.selected, _CHOSEN), (program.failed, _FAILED))
            if key is not None and key in self._points
        }
        self._show_points(special, is_moved)
        names = {key: text("program.mark", number=self._points[key][0]) for key in special}
        numbers = [
            (number, f"{number} !" if key == program.failed else names.get(key, ""))
            for key, (number, _) in self._points.items()
        ]
        points = [position for _, position in self._points.values()]
        self._show_labels([(points[group[0]], sentence) for group, sentence in labels_of(points, numbers)])

    def _show_points(self, special: dict[int, tuple[int, int, int]], is_moved: bool) -> None:
        """Draws all points, which are sent again only when they have moved, and on them those that stand out."""
        for handle in self._clouds[0 if is_moved else 1 :]:
            handle.remove()
        del self._clouds[0 if is_moved else 1 :]
        if not self._points:
            return
        if not self._clouds:
            places = np.array([position for _, position in self._points.values()], dtype=np.float32)
            self._clouds.append(self._cloud("points", places, np.array(_PLAIN, dtype=np.uint8), _SIZE))
        if special:
            places = np.array([self._points[key][1] for key in special], dtype=np.float32)
            self._clouds.append(
                self._cloud("marked", places, np.array(list(special.values()), dtype=np.uint8), _LARGER)
            )

    def _cloud(self, name: str, places: np.ndarray, colors: np.ndarray, size: float) -> Any:
        return self._scene.add_point_cloud(
            f"/program/{name}", places, colors, point_size=size, point_shape="circle", precision="float32"
        )

    def _show_labels(self, wanted: list[tuple[Array, str]]) -> None:
        """Draws labels; one that stays as it was is not sent again."""
        for handle in self._labels[len(wanted) :]:
            handle.remove()
        del self._labels[len(wanted) :]
        for place, (position, sentence) in enumerate(wanted):
            above = (float(position[0]), float(position[1]), float(position[2]) + _ABOVE)
            if place == len(self._labels):
                self._labels.append(
                    self._scene.add_label(
                        f"/program/{place}", sentence, position=above, anchor="bottom-center", depth_test=False,
                        font_screen_scale=0.8,
                    )
                )  # fmt: skip
                continue
            label = self._labels[place]
            if label.text != sentence:
                label.text = sentence
            if np.abs(np.asarray(label.position) - above).max() > 1e-7:
                label.position = above


def _positions(draft: Draft, model: RobotModel) -> dict[int, tuple[int, Array]]:
    """Returns number and position, [m], of each waypoint whose target is known, by key."""
    if draft.model != model.name:
        return {}
    found: dict[int, tuple[int, Array]] = {}
    arm = draft.arm(model)
    for number, step in enumerate(draft.steps, start=1):
        try:
            target = target_in_base(step.waypoint, arm)
        except RcilabError:
            continue
        if target is not None:
            found[step.key] = number, target.position
    return found


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
