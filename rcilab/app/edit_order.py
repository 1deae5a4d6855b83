"""One history of everything on the page: the order of the edits, each of which its feature can undo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Feature: TypeAlias = Literal["goal", "program", "cell", "setup"]
_LONGEST = 500
"""Largest number of edits in the order; a feature keeps fewer."""


@dataclass(frozen=True, slots=True)
class Edit:
    """An edit of one feature, for one arm."""

    feature: Feature
    model: str


class EditOrder:
    """Which edit came last, and which was undone last. Owned by the dispatcher's thread."""

    def __init__(self) -> None:
        self._done: list[Edit] = []
        self._undone: list[Edit] = []

    def add(self, feature: Feature, model: str) -> None:
        """Adds an edit; what was undone before can no longer be repeated."""
        self._done = [*self._done[1 - _LONGEST :], Edit(feature, model)]
        self._undone = [edit for edit in self._undone if edit.model != model]

    def undone(self, feature: Feature, model: str) -> None:
        """Notes that the last edit of a feature was undone."""
        if _remove_last(self._done, Edit(feature, model)):
            self._undone.append(Edit(feature, model))

    def repeated(self, feature: Feature, model: str) -> None:
        """Notes that the edit of a feature that was undone last was repeated."""
        if _remove_last(self._undone, Edit(feature, model)):
            self._done.append(Edit(feature, model))

    def forget(self, feature: Feature, model: str) -> None:
        """Forgets the edits of a feature: it cannot undo them any more."""
        gone = Edit(feature, model)
        self._done = [edit for edit in self._done if edit != gone]
        self._undone = [edit for edit in self._undone if edit != gone]

    def counts(self, feature: Feature, model: str) -> tuple[int, int]:
        """Returns how many edits of a feature can be undone, and repeated."""
        edit = Edit(feature, model)
        return self._done.count(edit), self._undone.count(edit)

    def last(self, model: str) -> Feature | None:
        """Returns the feature of the last edit for an arm; None without one."""
        return next((edit.feature for edit in reversed(self._done) if edit.model == model), None)

    def next(self, model: str) -> Feature | None:
        """Returns the feature of the edit that was undone last for an arm; None without one."""
        return next((edit.feature for edit in reversed(self._undone) if edit.model == model), None)


def _remove_last(edits: list[Edit], edit: Edit) -> bool:
    for index in range(len(edits) - 1, -1, -1):
        if edits[index] == edit:
            del edits[index]
            return True
    return False
