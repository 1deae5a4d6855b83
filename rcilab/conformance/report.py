"""The report of a check: one row per condition, one sentence per violation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from rcilab.conformance.advice import plural, share, with_degrees
from rcilab.conformance.catalogue import Language, Phrase
from rcilab.conformance.certificate import Certificate
from rcilab.conformance.explain import MAX_LISTED, explain_report, explain_violation
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

_ROUNDING = 1e-2
"""Part of the tolerance at an end of a motion below which a value is shown as 0."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionResult:
    """One condition, and the motion's worst value of it."""

    condition: Condition
    """The condition, with quantity, formula and source."""
    value: float
    """The worst value, in the condition's unit; NaN: not a number, or not in the record."""
    bound: float
    """The bound on the side of the worst value."""
    ratio: float
    """Distance of the worst value from the middle of the allowed range, relative to that of the bound."""
    joint: int
    """Joint with the worst value, from 1; 0 for the tool."""
    time: float
    """Time of the worst value, [s] since the start of the motion."""
    broken: int
    """Number of samples that violate the condition, over all joints."""
    links: LinkPair | None = None
    """The two links of the worst distance; None for other conditions."""
    start_excess: float = 0.0
    """Distance of the tool outside the safety box at the start, from where it may move inwards, [m]; 0 inside, and in
    all other rows."""
    limits: tuple[float, float] | None = None
    """Both bounds of a range whose middle is not 0, from which `ratio` is counted; None for other conditions."""

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
        """Source of condition and bound."""
        return self.condition.source

    @property
    def necessity(self) -> Necessity:
        """Necessary or recommended."""
        return self.condition.necessity

    @property
    def fault(self) -> FaultCode | None:
        """Fault that the controller raises for a violation; None if it does not check the condition."""
        return self.condition.fault

    @property
    def unit(self) -> str:
        """Unit of value and bound."""
        return self.condition.unit

    @property
    def location(self) -> str:
        """Axis or part of the value: "joint 2", "tool", or "base and link 5"."""
        return str(self.links) if self.links else self.condition.location(self.joint)

    @property
    def displayed(self) -> tuple[float, float]:
        """Worst value and bound for display; a bound that is only rounding is 0, and so is a value within it."""
        condition = self.condition
        if condition.is_measured or (condition.signal != "position" and condition.stage == "throughout"):
            return self.value, self.bound
        if condition.order:
            return self._rest, self.bound
        if self.ok and self.start_excess:
            return self.start_excess, 0.0
        return 0.0 if self.ok and abs(self.value) <= abs(self.bound) else self.value, 0.0

    @property
    def has_share(self) -> bool:
        """Whether `ratio` is a share of the bound: not of the bound 0, nor of a distance, whose bound is a minimum."""
        condition = self.condition
        if condition.is_clearance:
            return False
        return self.ok and not self.start_excess if condition.signal == "position" else condition.stage == "throughout"

    @property
    def texts(self) -> tuple[str, str, str]:
        """Worst value, bound and used part as text; a value at an end that is small within its tolerance is 0."""
        used = share(self.ratio) if self.has_share else ""
        if math.isnan(self.value):
            return "-", f"{self.bound:.4g}", ""
        if self.condition.signal == "position":
            return f"{self.displayed[0]:.4g}", "0", used
        if self.condition.stage == "throughout":
            return *format_pair(self.value, self.bound), used
        return f"{self._rest:.4g}", f"0 ± {abs(self.bound):.4g}", ""

    @property
    def _rest(self) -> float:
        """The value at an end, 0 where it is rounding compared to its tolerance."""
        return 0.0 if abs(self.value) < _ROUNDING * abs(self.bound) else self.value

    @property
    def verdict(self) -> str:
        """The result: ok, advice (a recommended condition is violated) or violated."""
        if self.ok:
            return "ok"
        return "violated" if self.necessity == "necessary" else "advice"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Violation:
    """Consecutive samples of one joint that violate one condition; `str` returns a sentence.

    Attributes:
        condition: The violated condition.
        joint: Number of the joint, from 1; 0 for the tool.
        time: Time of the first sample, [s] since the start of the motion.
        count: Number of consecutive samples, 1 ms each.
        value: Worst value, in the condition's unit.
        worst_time: Time of the worst value, [s].
        bound: The violated bound.
        ratio: As in `ConditionResult`; 1 is the bound.
        advice: Remedy.
        links: The two links of the worst distance; None for other conditions.
        reported: What the controller reported, where a record lacks the value; otherwise "".
    """

    condition: Condition
    """The violated condition."""
    joint: int
    """Number of the joint, from 1; 0 for the tool."""
    time: float
    """Time of the first sample, [s] since the start of the motion."""
    count: int
    """Number of consecutive samples, 1 ms each."""
    value: float
    """Worst value, in the condition's unit."""
    worst_time: float
    """Time of the worst value, [s]."""
    bound: float
    """The violated bound."""
    ratio: float
    """As in `ConditionResult`; 1 is the bound."""
    advice: str
    """Remedy."""
    links: LinkPair | None = None
    """The two links of the worst distance; None for other conditions."""
    reported: str = ""
    """What the controller reported, where a record lacks the value; "" where there is one. It is in English."""

    @property
    def fault(self) -> FaultCode | None:
        """Fault that the controller raises; None if it does not check the condition."""
        return self.condition.fault

    @property
    def location(self) -> str:
        """Axis or part of the value: "joint 2", "tool", or "base and link 5"."""
        return str(self.links) if self.links else self.condition.location(self.joint)

    def explain(self, language: Language = "en", units: Units | None = None) -> str:
        """Returns the violation in sentences: value, fault and remedy. Arguments as of `Report.explain`.

        Raises:
            InvalidValueError: The language is unknown.
        """
        return explain_violation(self, language, units)

    def __repr__(self) -> str:
        return f"<Violation: {self}>"

    def __str__(self) -> str:
        row = self.condition
        lasting = f", from t = {self.time:.3f} s on for {self.count} ms" if self.count > 1 else ""
        when = f" at t = {self.worst_time:.3f} s{lasting}" if row.stage == "throughout" else ""
        is_advice = row.necessity == "recommended" and row.fault is None
        passes = ": the controller does not stop for it" if is_advice else ""
        return f"{self.location}: {self._describe_value()}{when} ({row.necessity} condition{passes}); {self.advice}"

    def _describe_value(self) -> str:
        row = self.condition
        if self.reported:
            return f"{row.quantity}: the controller reported: {self.reported}"
        if math.isnan(self.value):
            return f"{row.quantity} is not a finite number"
        value, bound = format_pair(self.value, self.bound)
        if row.stage != "throughout":
            return f"{row.quantity} is {value} {row.unit}, not 0 within {abs(self.bound):.4g} {row.unit}"
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
    """The result of the check of one motion; `print` shows a table and a sentence per violation.

    Attributes:
        ok: Whether every necessary condition holds.
        certificate: The certificate that `execute` requires; None if the report is not ok.
        title: Arm and motion, as text.
        rows: One `ConditionResult` per condition, in the manual's order: worst value, bound, joint and time.
        worst: The row of the necessary condition closest to, or farthest beyond, its bound.
        violations: Violations of necessary conditions, worst first: the robot would stop, or hit itself or the floor.
        warnings: Violations of recommended conditions, worst first.
        motion: The motion that was checked.
        start: The state of the arm at the start of the check.
        measure: Evaluates every cycle, for `usage`.
        issue: Issues the certificate, for `certificate`.
        check_again: Checks another motion by some of the rows, for the same arm, start, safety box and mode.
    """

    title: Phrase
    """Arm and motion, as text."""
    rows: tuple[ConditionResult, ...]
    """One per condition, in the manual's order."""
    violations: tuple[Violation, ...]
    """Violations of necessary conditions, worst first: the robot would stop, or hit itself or the floor."""
    warnings: tuple[Violation, ...]
    """Violations of recommended conditions, worst first."""
    motion: Motion
    """The motion that was checked."""
    start: StartState
    """The state of the arm at the start of the check."""
    measure: Callable[[], Usage] = field(repr=False)
    """Evaluates every cycle, for `usage`."""
    issue: Callable[[], Certificate | None] = field(repr=False)
    """Issues the certificate, for `certificate`."""
    check_again: Callable[[Motion, tuple[Condition, ...]], Report] = field(repr=False)
    """Checks another motion by some of the rows, for the same arm, start, safety box and mode."""

    @property
    def ok(self) -> bool:
        """Whether every necessary condition holds."""
        return not self.violations

    @property
    def worst(self) -> ConditionResult:
        """The necessary condition closest to, or farthest beyond, its bound."""
        return max((row for row in self.rows if row.necessity == "necessary"), key=lambda row: (not row.ok, row.ratio))

    @property
    def certificate(self) -> Certificate | None:
        """The certificate for `execute`; None if the report is not ok."""
        return self.issue() if self.ok else None

    def usage(self) -> Usage:
        """Returns the worst necessary condition in every cycle, and the used part of its bound."""
        return self.measure()

    def require(self) -> Report:
        """Returns this report if it is ok.

        Raises:
            ConformanceError: A necessary condition is violated; `.violations` has all violations.
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
        """Returns the smallest slow-down with which the motion conforms, or why none exists.

        The path does not change; the whole motion becomes slower. The factor is found to 0.1 % and the slowed motion is
        checked; it has its own report. A path outside a range or the box, or a start away from the arm, cannot be
        corrected. Accelerations of given rows (`Motion.from_cycles`) jump slightly from row to row, which matters at
        some factors and not at others; for them a smaller factor may conform by chance.

        Args:
            recommended: Whether to satisfy the recommended conditions too, as far as a slow-down can.
            at_most: Largest factor to try, 1 or more; None is 20, or less for a motion that would then last more than
                ten minutes.
            progress: Called after every attempt with the estimated progress, 0 to 1; an exception raised by it cancels
                the search.

        Raises:
            InvalidValueError: `at_most` is not a number of at least 1.
        """
        return find_slow_down(self, recommended=recommended, at_most=at_most, progress=progress)

    @property
    def violated_conditions(self) -> int:
        """Number of violated conditions; one may have violations at several times and of several joints."""
        return len({violation.condition.id for violation in self.violations})

    def explain(self, language: Language = "en", units: Units | None = None, *, slowed: SlowDown | None = None) -> str:
        """Returns the report in sentences: values, joints, times, faults and remedies.

        It ends with the result of `slow_down`, and takes as long unless that is passed.

        Args:
            language: "en" is English, "zh" Chinese.
            units: Units of angles and lengths; None is SI, with degrees next to radians.
            slowed: Result of `slow_down`, if known.

        Raises:
            InvalidValueError: The language is unknown.
        """
        return explain_report(self, language, units, slowed)

    def __str__(self) -> str:
        lines = [self.title, self._verdict()]
        width = max(len(row.id) for row in self.rows)
        for row in self.rows:
            value, bound, used = row.texts
            place = f"{row.location}, t = {row.time:.3f} s"
            relation = " >" if row.condition.is_clearance else "of"
            size = f"{value:>9} {relation} {bound:>10} {row.unit:7} {used:>7}"
            lines.append(f"  {row.verdict:8}  {row.id:{width}}  {size}  {place}  [{row.source}]")
        found = (*self.violations, *self.warnings)
        lines += [f"- {violation}" for violation in found[:MAX_LISTED]]
        if len(found) > MAX_LISTED:
            lines.append(f"- ... and {len(found) - MAX_LISTED} more")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<Report {self._verdict()}>"

    def _repr_html_(self) -> str:
        return report_html(self, notebook_language())

    def _verdict(self) -> str:
        worst = self.worst
        if self.ok:
            nearest = f"{worst.condition.quantity} of {worst.location}, {share(worst.ratio)} of its bound"
            if worst.condition.is_clearance:
                nearest = f"{worst.location}, {worst.value:.4g} m apart"
            advice = f"; {plural(len(self.warnings), 'recommendation')} not met" if self.warnings else ""
            return f"conforms{advice}; nearest necessary bound: {nearest}"
        broken = [row for row in self.rows if not row.ok and row.necessity == "necessary"]
        names = ", ".join(dict.fromkeys(row.fault.manual_name for row in broken if row.fault is not None))
        outcome = f"the robot would stop with {names}" if names else "the robot would not notice before it hits"
        return f"does not conform: {plural(len(self.violations), 'violation')}; {outcome}"
