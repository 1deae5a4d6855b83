"""A finding: the answer to one question about this machine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias

Verdict: TypeAlias = Literal["ok", "note", "bad"]


@dataclass(frozen=True, slots=True)
class Finding:
    """The answer to one question about this machine."""

    name: str
    verdict: Verdict
    """`note`: works, with a drawback, or cannot be determined; `bad`: a part of rcilab does not work."""
    value: str
    """What was found, in words."""
    advice: str = ""
    """What to do about it; empty when all is well."""
    figures: Mapping[str, float] = field(default_factory=dict[str, float])
    """What was measured; the unit is the last part of each name."""

    def __str__(self) -> str:
        return f"{self.verdict:4}  {self.name:20}  {self.value}" + (f"; {self.advice}" if self.advice else "")

    def as_json(self) -> dict[str, Any]:
        """Returns the entry that `rcilab doctor --json` prints."""
        return asdict(self)


def summary(findings: Iterable[Finding]) -> str:
    """Returns the last line of the report: what is to be mended, or that nothing is in the way."""
    bad = [finding.name for finding in findings if finding.verdict == "bad"]
    return f"{len(bad)} to mend: {', '.join(bad)}" if bad else "ready: nothing is in the way"
