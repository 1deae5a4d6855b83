"""What can be closed can stand in a `with` statement."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class Closeable(ABC):
    """Owns something until it is closed; leaving its `with` block closes it, whatever happened there."""

    @abstractmethod
    def close(self) -> None:
        """Lets go of what is owned. May be called twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
