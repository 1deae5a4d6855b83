"""Base class of objects that own a resource and work as context managers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class Closeable(ABC):
    """Owns a resource until it is closed; leaving its `with` block closes it, also after an exception."""

    @abstractmethod
    def close(self) -> None:
        """Releases the resource. May be called twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
