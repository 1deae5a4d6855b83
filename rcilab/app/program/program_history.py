"""The programs of all arms, each with its undo history."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from rcilab.app.program.program_draft import Draft, ProgramState
from rcilab.app.store import Store
from rcilab.i18n.translator import Message, message

_UNDO_DEPTH = 200


@dataclass
class _ArmHistory:
    """The program of one arm, with its undo history, while another arm is chosen."""

    state: ProgramState
    past: list[Draft] = field(default_factory=list)
    future: list[Draft] = field(default_factory=list)


class ProgramHistory:
    """Replaces the program that the page shows. Owned by the dispatcher's thread.

    Args:
        store: The state.
        interrupt: Cancels the planning of a program that is about to change; returns whether there was one.
    """

    def __init__(self, store: Store, interrupt: Callable[[], bool]) -> None:
        self._store, self.interrupt = store, interrupt
        self._histories: dict[str, _ArmHistory] = {}

    @property
    def state(self) -> ProgramState:
        """The state of the Program tab."""
        return self._store.state.program

    @property
    def draft(self) -> Draft:
        """The program that is edited."""
        return self._store.state.program.draft

    def set(self, **changes: Any) -> None:
        """Changes the state of the Program tab."""
        self._store.update(program=replace(self.state, **changes))

    def open(self) -> None:
        """Shows the program of the chosen arm, and keeps that of the previous one."""
        left, model = self.draft, self._store.state.model.name
        if left.model == model:
            return
        self.interrupt()
        if left.model:
            self._current.state = replace(self.state, planned=None)
        found = self._histories.setdefault(model, _ArmHistory(ProgramState(draft=Draft(model=model))))
        self._store.update(program=found.state)
        if left.steps:
            self._store.notify("good", message("program.kept", count=len(left.steps), model=left.model))
        elif found.state.draft.steps:
            self._store.notify("good", message("program.back", count=len(found.state.draft.steps), model=model))

    def lay_aside(self, draft: Draft) -> None:
        """Keeps the program of an arm that is not chosen."""
        state = ProgramState(draft=draft, selected=draft.steps[0].key if draft.steps else None)
        self._histories[draft.model] = _ArmHistory(state)

    def change(self, draft: Draft, selected: int | None, *, typed: bool = False) -> None:
        """Replaces the program; undo restores the previous one.

        Args:
            draft: The new one.
            selected: Key of the step that becomes selected.
            typed: Whether a number was typed: the problems of other fields stay.
        """
        history, problems = self._current, self._store.state.problems
        self._store.order.add("program", self.draft.model)
        history.past, history.future = [*history.past[-_UNDO_DEPTH:], self.draft], []
        self._exchange(draft, selected)
        if typed:
            self._store.update(problems=problems)

    def rename(self, name: str) -> None:
        """Renames the program, which changes no plan of it."""
        state, history = self.state, self._current
        self._store.order.add("program", self.draft.model)
        history.past, history.future = [*history.past[-_UNDO_DEPTH:], self.draft], []
        draft = replace(self.draft, name=name)
        planned = draft if state.planned is state.draft else state.planned
        self.set(draft=draft, planned=planned, can_undo=True, can_redo=False)

    def undo(self) -> None:
        """Undoes the last change."""
        if self._current.past:
            self._current.future.append(self.draft)
            self._store.order.undone("program", self.draft.model)
            self._exchange(self._current.past.pop(), self.state.selected)

    def redo(self) -> None:
        """Repeats the change that was undone last."""
        if self._current.future:
            self._current.past.append(self.draft)
            self._store.order.repeated("program", self.draft.model)
            self._exchange(self._current.future.pop(), self.state.selected)

    def answer(self, name: str, problem: Message | None) -> bool:
        """Shows or clears the problem of a typed value; returns whether the value is valid."""
        if problem is None:
            self._store.clear_problems(name)
            return True
        self._store.set_problem(name, problem)
        return False

    @property
    def _current(self) -> _ArmHistory:
        return self._histories[self.draft.model]

    def _exchange(self, draft: Draft, selected: int | None) -> None:
        is_dropped, history = self.interrupt(), self._current
        if draft.index(selected) is None:
            selected = draft.steps[-1].key if draft.steps else None
        self.set(
            draft=draft, selected=selected, marked=frozenset(), scrolled=None, can_undo=bool(history.past),
            can_redo=bool(history.future), failed=None, notes=(), tone="warn",
            answer=message("program.changed") if is_dropped else None,
        )  # fmt: skip
        self._store.clear_problems("program.")
