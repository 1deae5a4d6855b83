"""What a check found: one row a condition, one sentence a violation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rcilab.conformance.advice import share, with_degrees
from rcilab.conformance.catalogue import Language, Phrase
from rcilab.conformance.certificate import Certificate
from rcilab.conformance.explain import LISTED, explain_report, explain_violation
from rcilab.conformance.html import report_html
from rcilab.conformance.limit_utilisation import Usage
from rcilab.conformance.start import StartState
from rcilab.conformance.time_scaling import SlowDown, find_slow_down
from rcilab.core.clearance import LinkPair
from rcilab.core.condition import Condition, Necessity
from rcilab.core.errors import ConformanceError
from rcilab.core.fault import FaultCode
from rcilab.i18n.notebook_language import language as notebook_language
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.units import Units
from rcilab.motion.motion import Motion


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionResult:
    """One condition, and how near the motion comes to its bound."""

    condition: Condition
    """What is demanded: its quantity, its formula and its source."""
    value: float
    """The worst value, in the condition's unit."""
    bound: float
    """The bound on that side."""
    ratio: float
    """How much of the way from the middle of the allowed range to the bound is used; 1 is the bound."""
    joint: int
    """Joint with the worst value, from 1; 0 for the tool."""
    time: float
    """When, [s] since the start of the motion."""
    broken: int
    """Number of samples that break the condition, over all joints."""
    links: LinkPair | None = None
    """The two links of the worst distance; None for other conditions."""
    led_in: float = 0.0
    """How far outside the safety box the tool starts, to be led in, [m]; 0 inside, and in all other rows."""

    @property
    def ok(self) -> bool:
        """Whether the condition holds throughout."""
        return self.broken == 0

    @property
    def id(self) -> str:
        """The condition's name, such as "joint.velocity"."""
        return self.condition.id

    @property
    def source(self) -> str:
        """Where condition and bound come from."""
        return self.condition.source

    @property
    def necessity(self) -> Necessity:
        """Necessary or recommended."""
        return self.condition.necessity

    @property
    def fault(self) -> FaultCode | None:
        """What the controller raises when it is broken; None for what it only recommends, or does not check."""
        return self.condition.fault

    @property
    def unit(self) -> str:
        """Unit of value and bound."""
        return self.condition.unit

    @property
    def place(self) -> str:
        """Whose value it is: "joint 2", "tool", or "base and link 5"."""
        return str(self.links) if self.links else self.condition.location(self.joint)

    @property
    def shown(self) -> tuple[float, float]:
        """Worst value and bound as people read them: one that only allows for rounding is 0, and what keeps it."""
        condition = self.condition
        if condition.is_measured or (condition.signal != "position" and condition.stage == "throughout"):
            return self.value, self.bound
        if self.ok and self.led_in:
            return self.led_in, 0.0
        return 0.0 if self.ok and abs(self.value) <= abs(self.bound) else self.value, 0.0

    @property
    def has_share(self) -> bool:
        """Whether `ratio` is a part of the bound: not of 0, nor of a distance, which is to stay above its bound."""
        condition = self.condition
        if condition.is_clearance:
            return False
        return self.ok and not self.led_in if condition.signal == "position" else condition.stage == "throughout"

    @property
    def texts(self) -> tuple[str, str, str]:
        """Worst value, bound and used part as text; what is to be zero at an end, and is, reads 0."""
        used = share(self.ratio) if self.has_share else ""
        if self.condition.signal == "position":
            return f"{self.shown[0]:.4g}", "0", used
        if self.condition.stage == "throughout":
            return *format_pair(self.value, self.bound), used
        return "0" if self.ok else f"{self.value:.4g}", f"0 ± {abs(self.bound):g}", ""

    @property
    def verdict(self) -> str:
        """One word: ok, advice (a recommended condition is broken) or violated."""
        if self.ok:
            return "ok"
        return "violated" if self.necessity == "necessary" else "advice"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Violation:
    """Consecutive samples of one joint that break one condition; `str` returns a sentence.

    Attributes:
        condition: What is broken.
        joint: From 1; 0 for the tool.
        time: The first of the samples, [s] since the start of the motion.
        count: How many samples in a row, at 1 ms each.
        value: The worst of them, in the condition's unit.
        worst_time: When it is worst, [s].
        bound: The bound it passes.
        ratio: As in ConditionResult; 1 is the bound.
        advice: What to do about it.
        links: The two links of the worst distance; None for other conditions.
    """

    condition: Condition
    """What is broken."""
    joint: int
    """From 1; 0 for the tool."""
    time: float
    """The first of the samples, [s] since the start of the motion."""
    count: int
    """How many samples in a row, at 1 ms each."""
    value: float
    """The worst of them, in the condition's unit."""
    worst_time: float
    """When it is worst, [s]."""
    bound: float
    """The bound it passes."""
    ratio: float
    """As in ConditionResult; 1 is the bound."""
    advice: str
    """What to do about it."""
    links: LinkPair | None = None
    """The two links of the worst distance; None for other conditions."""

    @property
    def fault(self) -> FaultCode | None:
        """What the controller raises; None for what it only recommends, or does not check."""
        return self.condition.fault

    @property
    def place(self) -> str:
        """Whose value it is: "joint 2", "tool", or "base and link 5"."""
        return str(self.links) if self.links else self.condition.location(self.joint)

    def explain(self, language: Language = "en", units: Units | None = None) -> str:
        """Returns it in sentences: the fact, the fault, the remedy. Arguments as of `Report.explain`.

        Raises:
            InvalidValueError: There is no such language.
        """
        return explain_violation(self, language, units)

    def __repr__(self) -> str:
        return f"<Violation: {self}>"

    def __str__(self) -> str:
        row = self.condition
        lasting = f" and for {self.count} ms" if self.count > 1 else ""
        when = f" at t = {self.time:.3f} s{lasting}" if row.stage == "throughout" else ""
        is_advice = row.necessity == "recommended" and row.fault is None
        passes = ": the controller does not stop for it" if is_advice else ""
        return f"{self.place}: {self._what()}{when} ({row.necessity} condition{passes}); {self.advice}"

    def _what(self) -> str:
        """Returns quantity, value and bound in words."""
        row = self.condition
        value, bound = format_pair(self.value, self.bound)
        if row.stage != "throughout":
            return f"{row.quantity} is {value} {row.unit}, not 0"
        if row.signal == "position":
            return f"{row.quantity} is {self.value:.4g} m outside the safety box"
        if row.signal == "frame":
            return f"{row.quantity} is improper, out of reach or singular"
        if row.signal == "elbow_sign":
            return "it is flipped to the other side than at the start"
        if row.is_clearance:
            overlap = ", they overlap," if self.value < 0.0 else ""
            return f"{row.quantity} {value} m{overlap} is not above {bound} m"
        if row.unit == "rad":
            return f"{row.quantity} {with_degrees(self.value, value)} passes {with_degrees(self.bound, bound)}"
        return f"{row.quantity} {value} {row.unit} exceeds {bound.lstrip('-')} {row.unit}"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Report:
    """The verdict on one motion; `print` shows it as a table with a sentence for each violation.

    Attributes:
        ok: Whether every necessary condition holds.
        certificate: The proof that `execute` asks for; None when the report is not ok.
        title: Which motion on which arm, in words.
        rows: One ConditionResult a condition, in the manual's order: worst value, bound, joint and time.
        worst: The row of the necessary condition nearest to, or farthest past, its bound.
        violations: Necessary conditions that are broken, worst first: the robot would stop, or hit itself or the floor.
        warnings: Recommended conditions that are broken, worst first.
        motion: The motion that was checked.
        start: The state of the arm at the start of the check.
        measure: Evaluates every cycle, for `usage`.
        issue: Makes the certificate, for `certificate`.
        check_again: Checks another motion by some of the rows, for the same arm, start, safety box and mode.
    """

    title: Phrase
    """Which motion on which arm, in words."""
    rows: tuple[ConditionResult, ...]
    """One a condition, in the manual's order."""
    violations: tuple[Violation, ...]
    """Necessary conditions that are broken, worst first: the robot would stop, or hit itself or the floor."""
    warnings: tuple[Violation, ...]
    """Recommended conditions that are broken, worst first."""
    motion: Motion
    """The motion that was checked."""
    start: StartState
    """The state of the arm at the start of the check."""
    measure: Callable[[], Usage] = field(repr=False)
    """Evaluates every cycle, for `usage`."""
    issue: Callable[[], Certificate] = field(repr=False)
    """Makes the certificate, for `certificate`."""
    check_again: Callable[[Motion, tuple[Condition, ...]], Report] = field(repr=False)
    """Checks another motion by some of the rows, for the same arm, start, safety box and mode."""

    @property
    def ok(self) -> bool:
        """Whether every necessary condition holds."""
        return not self.violations

    @property
    def worst(self) -> ConditionResult:
        """The necessary condition nearest to, or farthest past, its bound."""
        return max((row for row in self.rows if row.necessity == "necessary"), key=lambda row: (not row.ok, row.ratio))

    @property
    def certificate(self) -> Certificate | None:
        """The proof for a hand-off; a report that is not ok has none."""
        return self.issue() if self.ok else None

    def usage(self) -> Usage:
        """Returns which necessary condition is worst in every cycle, and how much of its bound is used there."""
        return self.measure()

    def require(self) -> Report:
        """Returns this report if it is ok.

        Raises:
            ConformanceError: A necessary condition is broken; `.violations` has them all.
        """
        if self.ok:
            return self
        more = len(self.violations) - 1
        rest = f" (and {more} more)" if more else ""
        raise ConformanceError(f"{self.violations[0]}{rest}", self.violations)

    def slow_down(
        self,
        *,
        recommended: bool = False,
        at_most: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> SlowDown:
        """Returns the least slow-down of the motion that passes, or why none does.

        The curve stays the same and runs slower as a whole. The factor is found to 0.1 % and checked: the motion comes
        with its own report. It does not help a path that leaves its range or the box, nor a start that is elsewhere.
        Rows from elsewhere (`Motion.from_cycles`) jump a little in acceleration from row to row, and that shows at one
        factor and not at the next: with them a smaller factor may pass by chance.

        Args:
            recommended: Whether to meet the recommended conditions too, those that some slow-down meets.
            at_most: Largest factor to try, 1 or more; None is 20, or less for a motion that would then last more than
                ten minutes.
            progress: Called after every try with the part of the work that is done, 0 to 1, as far as that can be
                known; what it raises ends the search.

        Raises:
            InvalidValueError: `at_most` is no number of at least 1.
        """
        return find_slow_down(self, recommended=recommended, at_most=at_most, progress=progress)

    @property
    def broken_conditions(self) -> int:
        """How many conditions the violations are of: one may be broken more than once, and by more than one joint."""
        return len({violation.condition.id for violation in self.violations})

    def explain(self, language: Language = "en", units: Units | None = None, *, slowed: SlowDown | None = None) -> str:
        """Returns in whole sentences what is wrong, where, when and by how much, what it raises and what to do.

        It ends with what `slow_down` finds, and so takes as long, unless that is given.

        Args:
            language: "en" is English, "zh" Chinese.
            units: Units of angles and lengths; None is SI, with degrees next to radians.
            slowed: What `slow_down` has found already.

        Raises:
            InvalidValueError: There is no such language.
        """
        return explain_report(self, language, units, slowed)

    def __str__(self) -> str:
        lines = [self.title, self._verdict()]
        width = max(len(row.id) for row in self.rows)
        for row in self.rows:
            value, bound, used = row.texts
            place = f"{row.place}, t = {row.time:.3f} s"
            relation = " >" if row.condition.is_clearance else "of"
            size = f"{value:>9} {relation} {bound:>10} {row.unit:7} {used:>7}"
            lines.append(f"  {row.verdict:8}  {row.id:{width}}  {size}  {place}  [{row.source}]")
        found = (*self.violations, *self.warnings)
        lines += [f"- {violation}" for violation in found[:LISTED]]
        if len(found) > LISTED:
            lines.append(f"- ... and {len(found) - LISTED} more")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<Report {self._verdict()}>"

    def _repr_html_(self) -> str:
        return report_html(self, notebook_language())

    def _verdict(self) -> str:
        worst = self.worst
        if self.ok:
            near = f"{worst.condition.quantity} of {worst.place}, {share(worst.ratio)} of its bound"
            if worst.condition.is_clearance:
                near = f"{worst.place}, {worst.value:.4g} m apart"
            advice = f"; {_plural(len(self.warnings), 'recommendation')} not met" if self.warnings else ""
            return f"conforms{advice}; nearest necessary bound: {near}"
        broken = [row for row in self.rows if not row.ok and row.necessity == "necessary"]
        names = ", ".join(dict.fromkeys(row.fault.manual_name for row in broken if row.fault is not None))
        outcome = f"the robot would stop with {names}" if names else "the robot would not notice before it hits"
        return f"does not conform: {_plural(len(self.violations), 'violation')}; {outcome}"


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
