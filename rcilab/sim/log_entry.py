"""One entry of a controller's log, as a value, and its two written forms."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal, TypeAlias, get_args

from rcilab.core.clock import CYCLE_TIME

LogFormat: TypeAlias = Literal["text", "json"]
LOG_FORMATS: tuple[LogFormat, ...] = get_args(LogFormat)

_PREFIX = "rcilab controller"


@dataclass(frozen=True, slots=True, kw_only=True)
class LogEntry:
    """What happened, and when by both clocks."""

    kind: str
    """Kind of event, such as "refused"; `log_lines.KINDS` lists them."""
    text: str
    """One sentence."""
    cycle: int
    """Number of the last state before it; the controller's time since power-up in milliseconds."""
    wall: float
    """Time of day, [s] since the epoch."""
    facts: Mapping[str, object] = field(default_factory=dict[str, object])
    """Numbers and names in the text, by key, such as the request, its status and the phase."""

    @property
    def t(self) -> float:
        """The controller's time since power-up, [s]."""
        return self.cycle * CYCLE_TIME

    def as_text(self) -> str:
        """Returns the line for a terminal: time of day, controller's time, text."""
        return f"{_PREFIX}: {datetime.fromtimestamp(self.wall):%H:%M:%S.%f}"[:-3] + f" {self.t:.3f} s {self.text}"

    def as_json(self) -> str:
        """Returns the line for a program: one JSON object."""
        stamp = datetime.fromtimestamp(self.wall).astimezone().isoformat(timespec="milliseconds")
        content = {"time": stamp, "t": round(self.t, 3), "kind": self.kind, "text": self.text, **self.facts}
        return json.dumps(content, ensure_ascii=False, default=str)

    def written(self, form: LogFormat) -> str:
        """Returns its line in a format."""
        return self.as_json() if form == "json" else self.as_text()
