"""Undo and redo of everything on the page, in the order in which it was edited."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from rcilab.app.edit_order import Feature
from rcilab.app.request import Handlers, Request
from rcilab.app.store import Store
from rcilab.i18n.translator import message

TurnBackFeature: TypeAlias = Callable[[Literal["undo", "redo"]], object]


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnBack(Request):
    """Undo the last edit on the page, or repeat the one that was undone last."""

    what: Literal["undo", "redo"]


class EditHistory:
    """Owned by the dispatcher's thread.

    Args:
        store: The state, with the order of all edits.
        features: Undoes and repeats the edits of each feature.
    """

    def __init__(self, store: Store, features: Mapping[Feature, TurnBackFeature]) -> None:
        self._store, self._features = store, features

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            TurnBack: self.turn_back,
        }

    def tick(self) -> None:
        """Shows whether there is something to undo or repeat."""
        order, model = self._store.order, self._store.state.model.name
        turns = order.last(model) is not None, order.next(model) is not None
        if turns != self._store.state.turns:
            self._store.update(turns=turns)

    def turn_back(self, request: TurnBack) -> None:
        """Undoes or repeats an edit, and says which."""
        order, model = self._store.order, self._store.state.model.name
        while True:
            feature = order.last(model) if request.what == "undo" else order.next(model)
            if feature is None:
                self._store.notify("warn", message(f"edit.nothing_{request.what}"), page=request.page)
                return
            before = order.counts(feature, model)
            self._features[feature](request.what)
            if order.counts(feature, model) != before:
                self._store.notify("good", message(f"edit.{request.what}", what=message(f"edit.{feature}")))
                return
            order.forget(feature, model)  # It keeps fewer edits than the order.
