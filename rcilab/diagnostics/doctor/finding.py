"""A finding: the result of one check of this machine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias

Verdict: TypeAlias = Literal["ok", "note", "bad"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check of this machine."""

    name: str
    verdict: Verdict
    """`note`: works, with a drawback, or cannot be determined; `bad`: a part of rcilab does not work."""
    value: str
    """Observed value or state, as text."""
    advice: str = ""
    """Remedy; empty if none is needed."""
    figures: Mapping[str, float] = field(default_factory=dict[str, float])
    """Measured numbers; the unit is the last part of each name."""

    def __str__(self) -> str:
        return f"{self.verdict:4}  {self.name:20}  {self.value}" + (f"; {self.advice}" if self.advice else "")

    def as_json(self) -> dict[str, Any]:
        """Returns the entry for `rcilab doctor --json`."""
        return asdict(self)


def summary(findings: Iterable[Finding]) -> str:
    """Returns the last line of the report: the failed checks, or that all passed."""
    bad = [finding.name for finding in findings if finding.verdict == "bad"]
    return f"{len(bad)} to fix: {', '.join(bad)}" if bad else "ready: no problem found"
