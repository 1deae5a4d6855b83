"""Where and how a run was made, as far as it is known."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, fields
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """The circumstances of a run. What is not known is empty."""

    target: str = ""
    """"virtual", or the address of the controller."""
    plant: str = ""
    """What a virtual controller moved: "ideal" or "mujoco"."""
    mode: str = ""
    """How the controller followed, such as "joint_position"."""
    started_ns: int = 0
    """When the run began, nanoseconds since 1970 (UTC); 0: not known."""

    @property
    def started(self) -> str:
        """When it began, as 2026-05-01T12:00:00Z; "" when that is not known."""
        return (
            time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(self.started_ns // 1_000_000_000))
            if self.started_ns
            else ""
        )

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields, ready for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Setup:
        """Returns what `as_dict` gave; fields of a later version are left out."""
        return cls(**{field.name: values[field.name] for field in fields(cls) if field.name in values})
