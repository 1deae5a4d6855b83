"""The Check tab as a value: what is being worked out, what came of it."""

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
"""A report shown as text, and the slow-down that belongs to it; a report that is ok has none."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Slowed:
    """A plan that was slowed down, and what brings the fast one back."""

    before: Plan
    after: Plan
    speed: float
    """Speed of the page before."""
    draft: Draft | None = None
    """The slowed program; None where no speed of a program was changed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CheckState:
    """Everything of the Check tab but the report itself, which is the plan's."""

    doing: Literal["slow", "explain"] | None = None
    """What is being worked out."""
    progress: float = 0.0
    """How much of it is done, 0 to 1."""
    answer: Message | None = None
    """What came of the last slow-down."""
    tone: Literal["good", "warn", "bad"] = "good"
    about: Report | None = None
    """The report that `answer` is about."""
    found: SlowDown | None = None
    """What was found where the plan stays as it is: it says why in its own words."""
    slowed: Slowed | None = None
    explained: Explained | None = None
    sought: int = 0
    """How often the moment of a row was shown."""
    row: str = ""
    """Id of the condition that was shown last."""
