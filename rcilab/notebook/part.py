"""The base class of every part of the lab: it shows a shared state, displays itself, and is closed with its cell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import Any

import ipywidgets

from rcilab.core.closeable import Closeable
from rcilab.i18n.notebook_language import chosen_language
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import RobotModel
from rcilab.notebook.cells import kernel_cells
from rcilab.notebook.state import LabState, Topic, state_of
from rcilab.notebook.style import close_tree, style_sheet
from rcilab.notebook.widget_sharing import shared_style_widget

_PACKAGE = "rcilab.notebook"


class Part(Closeable):
    """A part: displays itself as the last line of a cell, combines with others, is closed when its cell runs again.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.

    Raises:
        InvalidValueError: The subject is not one of these, or the language is unknown.
    """

    def __init__(self, subject: object, language: str | None = None) -> None:
        neighbour = subject.text.language if isinstance(subject, Part) else None
        self.state: LabState = state_of(subject)
        maker = self.state.model.description.maker
        self.text = Text(chosen_language(language, neighbour), _PACKAGE, maker=maker)
        self._cleanups: list[Callable[[], None]] = []
        self._root: Any = None
        self._closed = False
        kernel_cells().adopt(self)

    def __setattr__(self, name: str, value: object) -> None:
        """Sets existing attributes only: a misspelt name is an error."""
        is_known = name.startswith("_") or name in vars(self) or hasattr(type(self), name)
        if not is_known and vars(self).get("_root") is not None:
            known = [other for other in {*vars(self), *dir(type(self))} if not other.startswith("_")]
            close = get_close_matches(name, known, 1)
            hint = f"; did you mean {close[0]}?" if close else f"; there are {', '.join(sorted(known))}"
            raise AttributeError(f"{type(self).__name__} has no {name}{hint}")
        super().__setattr__(name, value)

    @property
    def model(self) -> RobotModel:
        """The arm."""
        return self.state.model

    @property
    def widget(self) -> Any:
        """The ipywidgets widget, for your own boxes."""
        return self._root

    def subscribe(self, topic: Topic, act: Callable[[], None]) -> None:
        """Subscribes to a topic of the state until this part is closed; `act` is also called immediately."""
        self._cleanups.append(self.state.subscribe(topic, act))
        act()

    def build(self, children: Sequence[Any], *classes: str, **layout: str) -> None:
        """Takes the widgets of this part, one below the other."""
        own = ipywidgets.Layout(**layout)
        self._root = shared_style_widget(
            ipywidgets.VBox, [style_sheet(), *children], layout=own, classes=("rl-root", *classes)
        )

    def halt(self) -> None:
        """Stops the motion that this part has started; most parts start none."""

    def close(self) -> None:
        """Removes the part and ends what it started; may be called twice."""
        if self._closed:
            return
        self._closed = True
        for end in self._cleanups:
            end()
        self.end()
        close_tree(self._root)
        kernel_cells().forget(self)

    def end(self) -> None:
        """Ends the servers, threads and processes of a part."""

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self._root._repr_mimebundle_(**options)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.model.name}{', closed' if self._closed else ''}>"
