"""The state of the Check tab: the job in progress and its result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from rcilab.i18n.translator import Message

if TYPE_CHECKING:
    from rcilab.app.planning import Plan
    from rcilab.app.program.program_draft import Draft
    from rcilab.conformance.report import Report
    from rcilab.conformance.time_scaling import SlowDown

Explained: TypeAlias = "tuple[Report, SlowDown | None]"
"""A report shown as text, with the slow-down that belongs to it; a report that is ok has none."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Slowed:
    """A plan that was slowed down, and what restores the fast one."""

    before: Plan
    after: Plan
    speed: float
    """Speed setting of the page before."""
    draft: Draft | None = None
    """The slowed program; None if no speed of a program was changed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CheckState:
    """The state of the Check tab without the report itself, which belongs to the plan."""

    doing: Literal["slow", "explain"] | None = None
    """The job in progress."""
    progress: float = 0.0
    """Share of the job that is done, 0 to 1."""
    answer: Message | None = None
    """Result of the last slow-down."""
    tone: Literal["good", "warn", "bad"] = "good"
    about: Report | None = None
    """The report that `answer` refers to."""
    found: SlowDown | None = None
    """The result if the plan stays as it is: it contains the reason."""
    slowed: Slowed | None = None
    explained: Explained | None = None
    seek_count: int = 0
    """Number of times that the moment of a row was shown."""
    row: str = ""
    """Id of the condition that was shown last."""
