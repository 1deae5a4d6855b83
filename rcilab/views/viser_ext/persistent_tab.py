"""A tab of viser's that stays, open or not, while everything in it is made anew.

Unnecessary once viser's tabs have a public call that removes their children.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class PersistentTab:
    """Keeps its place: a tab that is taken away and comes back is another one, to hands, layout and keyboard.

    Args:
        add: Adds a tab, `add(label, icon)`: that of a tab group or of a panel.
        icon: Its picture.
    """

    def __init__(self, add: Callable[[str, Any], Any], icon: str) -> None:
        self._add, self._icon = add, icon
        self._tab: Any = None

    @contextmanager
    def filled_anew(self, label: str) -> Iterator[None]:
        """Puts what is added inside the block into the tab, then takes out what was there before.

        Args:
            label: Its name from now on.
        """
        if self._tab is None:
            self._tab = self._add(label, self._icon)
        elif self._tab._label != label:  # viser 1.1 has no public spelling for a tab's name and what it holds.
            self._tab._label = label
            self._tab.icon = self._icon
        former = tuple(self._tab._children.values())
        with self._tab:
            yield
        for control in former:
            control.remove()
