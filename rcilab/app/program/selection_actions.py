"""Edits of several steps at once: which are selected, and copy, cut, paste, delete, move, search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from rcilab.app.program.program_draft import Draft, describe_step
from rcilab.app.program.program_history import ProgramHistory
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.app.text import Text
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import message
from rcilab.motion.waypoint import Waypoint, require_fit

if TYPE_CHECKING:
    from rcilab.app.program.edit_actions import EditProgram


class SelectionActions:
    """Owned by the dispatcher's thread; copies are kept for the programs of all arms.

    Args:
        store: The state.
        history: The programs.
    """

    def __init__(self, store: Store, history: ProgramHistory) -> None:
        self._store, self._history = store, history
        self._copied: tuple[Waypoint, ...] = ()
        self.edits: dict[str, Callable[[EditProgram], None]] = {
            "toggle": self._toggle, "extend": self._extend, "all": self._select_all, "copy": self._copy,
            "cut": self._cut, "paste": self._paste, "delete": self._delete, "duplicate": self._duplicate,
            "up": lambda request: self._move(-1), "down": lambda request: self._move(1),
        }  # fmt: skip

    @property
    def keys(self) -> tuple[int, ...]:
        """Keys of the selected steps, in their order."""
        state = self._history.state
        return state.draft.chosen(state.selected, state.marked)

    def find(self, typed: str) -> bool:
        """Selects the next step with a text: its number, type, name, signal or frame; returns whether there is one."""
        wanted, draft, text = typed.strip().casefold(), self._draft, Text(self._store.state.language)
        first = (draft.index(self._history.state.selected) or 0) + 1
        for index in (*range(first, len(draft.steps)), *range(min(first, len(draft.steps)))):
            if wanted == str(index + 1) or wanted in _words(draft.steps[index].waypoint, text):
                self._history.set(selected=draft.steps[index].key, marked=frozenset(), scrolled=None)
                return True
        return False

    @property
    def _draft(self) -> Draft:
        return self._history.draft

    def _mark(self, keys: Sequence[int], selected: int | None) -> None:
        self._history.set(selected=selected, marked=frozenset(keys) - {selected}, scrolled=None)

    def _toggle(self, request: EditProgram) -> None:
        """Adds a step to the selection, or takes it out."""
        keys, key = self.keys, request.key
        if key is None or self._draft.index(key) is None:
            return
        if key not in keys:
            self._mark(keys, key)
        elif len(keys) > 1:
            rest = [other for other in keys if other != key]
            self._mark(rest, rest[-1] if key == self._history.state.selected else self._history.state.selected)

    def _extend(self, request: EditProgram) -> None:
        """Selects all steps between the first selected one and another."""
        keys, key = self.keys, request.key
        if key is None or self._draft.index(key) is None:
            return
        at, other = self._draft.index(key) or 0, self._draft.index(keys[0] if keys else key) or 0
        if keys and at < other:
            other = self._draft.index(keys[-1]) or 0
        low, high = sorted((at, other))
        self._mark([step.key for step in self._draft.steps[low : high + 1]], key)

    def _select_all(self, request: EditProgram) -> None:
        self._mark([step.key for step in self._draft.steps], self._history.state.selected)

    def _copy(self, request: EditProgram) -> None:
        steps = self._draft.with_partners(self.keys)
        self._copied = tuple(step.waypoint for step in steps) or self._copied
        if steps:
            self._store.notify("good", message("program.copied_steps", count=len(steps)))

    def _cut(self, request: EditProgram) -> None:
        self._copy(request)
        self._delete(request)

    def _paste(self, request: EditProgram) -> None:
        if not self._copied:
            self._store.notify("warn", message("program.nothing_copied"))
            return
        try:
            for waypoint in self._copied:
                require_fit(waypoint, self._store.state.model.description)
        except InvalidValueError as error:
            self._store.notify("warn", explain_error(error))
            return
        keys = self.keys
        draft = self._draft
        if draft.start is None:
            self._store.notify("warn", message("program.empty"))
            return
        self._insert(draft, self._copied, keys[-1] if keys else None)

    def _insert(self, draft: Draft, waypoints: Sequence[Waypoint], after: int | None) -> None:
        keys: list[int] = []
        for waypoint in waypoints:
            draft, after = draft.inserted(waypoint, after)
            keys.append(after)
        self._history.change(draft, keys[-1])
        self._mark(keys, keys[-1])

    def _delete(self, request: EditProgram) -> None:
        keys = self.keys
        if not keys:
            return
        index = self._draft.index(keys[0]) or 0
        draft = self._draft.without(*keys)
        left = draft.steps[min(index, len(draft.steps) - 1)].key if draft.steps else None
        self._history.change(draft, left)

    def _duplicate(self, request: EditProgram) -> None:
        """Copies the selected steps, with whole blocks, behind the last of them."""
        steps = self._draft.with_partners(self.keys)
        if steps:
            self._insert(self._draft, [step.waypoint for step in steps], steps[-1].key)

    def _move(self, step: int) -> None:
        keys = self.keys
        draft = self._draft.shifted(keys, step)
        if draft is not self._draft:
            self._history.change(draft, self._history.state.selected)
            self._mark(keys, self._history.state.selected)


def _words(waypoint: Waypoint, text: Text) -> str:
    """Returns what a step can be found by."""
    said = text.render(describe_step(waypoint)) if waypoint.is_instruction else ""
    parts = (text(f"program.type.{waypoint.type}"), waypoint.type, waypoint.text, waypoint.frame, waypoint.signal, said)
    return " ".join(str(part) for part in parts if part is not None).casefold()
