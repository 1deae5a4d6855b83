"""The programs of all arms, each with what can be undone in it: none is ever dropped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from rcilab.app.program.program_draft import Draft, ProgramState
from rcilab.app.store import Store
from rcilab.i18n.translator import Message, message

_UNDO_DEPTH = 200


@dataclass
class _Shelf:
    """What belongs to one arm's program while another arm is chosen, and what can be undone in it."""

    state: ProgramState
    past: list[Draft] = field(default_factory=list)
    future: list[Draft] = field(default_factory=list)


class ProgramHistory:
    """Exchanges the program that the page shows. Owned by the dispatcher's thread.

    Args:
        store: The state.
        interrupt: Drops the planning of a program that is about to change; returns whether there was one.
    """

    def __init__(self, store: Store, interrupt: Callable[[], bool]) -> None:
        self._store, self.interrupt = store, interrupt
        self._shelves: dict[str, _Shelf] = {}

    @property
    def state(self) -> ProgramState:
        """The Program tab."""
        return self._store.state.program

    @property
    def draft(self) -> Draft:
        """The program that is edited."""
        return self._store.state.program.draft

    def set(self, **changes: Any) -> None:
        """Changes the Program tab."""
        self._store.update(program=replace(self.state, **changes))

    def open(self) -> None:
        """Takes out the program of the arm that is chosen, and keeps that of the other one."""
        left, model = self.draft, self._store.state.model.name
        if left.model == model:
            return
        self.interrupt()
        if left.model:
            self._shelf.state = replace(self.state, planned=None)
        found = self._shelves.setdefault(model, _Shelf(ProgramState(draft=Draft(model=model))))
        self._store.update(program=found.state)
        if left.steps:
            self._store.say("good", message("program.kept", count=len(left.steps), model=left.model))
        elif found.state.draft.steps:
            self._store.say("good", message("program.back", count=len(found.state.draft.steps), model=model))

    def lay_aside(self, draft: Draft) -> None:
        """Keeps the program of an arm that is not chosen."""
        state = ProgramState(draft=draft, selected=draft.steps[0].key if draft.steps else None)
        self._shelves[draft.model] = _Shelf(state)

    def change(self, draft: Draft, selected: int | None, *, typed: bool = False) -> None:
        """Exchanges the program; what it was can be had back.

        Args:
            draft: The new one.
            selected: Key of the step that is selected from then on.
            typed: Whether a number was typed: what is wrong with other typed ones stands beside them as before.
        """
        shelf, problems = self._shelf, self._store.state.problems
        shelf.past, shelf.future = [*shelf.past[-_UNDO_DEPTH:], self.draft], []
        self._exchange(draft, selected)
        if typed:
            self._store.update(problems=problems)

    def rename(self, name: str) -> None:
        """Gives the program another name, which changes no plan of it."""
        state, shelf = self.state, self._shelf
        shelf.past, shelf.future = [*shelf.past[-_UNDO_DEPTH:], self.draft], []
        draft = replace(self.draft, name=name)
        planned = draft if state.planned is state.draft else state.planned
        self.set(draft=draft, planned=planned, can_undo=True, can_redo=False)

    def undo(self) -> None:
        """Takes the last change back."""
        if self._shelf.past:
            self._shelf.future.append(self.draft)
            self._exchange(self._shelf.past.pop(), self.state.selected)

    def redo(self) -> None:
        """Makes the change again that was taken back last."""
        if self._shelf.future:
            self._shelf.past.append(self.draft)
            self._exchange(self._shelf.future.pop(), self.state.selected)

    def answer(self, name: str, problem: Message | None) -> bool:
        """Says what is wrong with what was typed; returns whether nothing is."""
        if problem is None:
            self._store.clear_problems(name)
            return True
        self._store.complain(name, problem)
        return False

    @property
    def _shelf(self) -> _Shelf:
        return self._shelves[self.draft.model]

    def _exchange(self, draft: Draft, selected: int | None) -> None:
        is_dropped, shelf = self.interrupt(), self._shelf
        if draft.place(selected) is None:
            selected = draft.steps[-1].key if draft.steps else None
        self.set(
            draft=draft, selected=selected, can_undo=bool(shelf.past), can_redo=bool(shelf.future), failed=None,
            notes=(), tone="warn", answer=message("program.changed") if is_dropped else None,
        )  # fmt: skip
        self._store.clear_problems("program.")
