"""A viser tab whose contents can be rebuilt.

Unnecessary once viser's tabs have a public function that removes their children.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class PersistentTab:
    """A tab that is retained while its contents are replaced, so that position, selection and focus are unchanged.

    Args:
        add: Function of a tab group or a panel that adds a tab, `add(label, icon)`.
        icon: Icon of the tab.
    """

    def __init__(self, add: Callable[[str, Any], Any], icon: str) -> None:
        self._add, self._icon = add, icon
        self._tab: Any = None

    @contextmanager
    def rebuild(self, label: str) -> Iterator[None]:
        """Returns a context manager: controls added in its block replace the previous contents of the tab.

        Args:
            label: New label of the tab.
        """
        if self._tab is None:
            self._tab = self._add(label, self._icon)
        elif self._tab._label != label:  # viser 1.1 has no public attributes for the label and the children of a tab.
            self._tab._label = label
            self._tab.icon = self._icon
        former = tuple(self._tab._children.values())
        with self._tab:
            yield
        for control in former:
            control.remove()
