"""The report on a recorded motion of a client: how near its commands came to each limit, and their timing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import numpy as np

from rcilab.conformance.advice import plural, share
from rcilab.conformance.report import ConditionResult, Report
from rcilab.core.errors import RcilabError
from rcilab.core.state import require_mode
from rcilab.i18n.translator import Remark
from rcilab.recording.client_motions import MotionEnd
from rcilab.recording.playout import played_commands
from rcilab.recording.run import Run
from rcilab.recording.sent_motion import check_sent

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_EDGES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # [ms] Between the bars of the histogram.
_BAR = 40  # Characters of the longest bar.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClientReport:
    """The report on one motion."""

    line: str
    """The result in one line."""
    text: str
    """All conditions, counts and the histogram, as lines."""


def report_on_client(run: Run, end: MotionEnd | None = None, name: str = "motion") -> ClientReport:
    """Returns the report on a run that a virtual controller recorded.

    Args:
        run: The run, with `PLAYOUT_FIELDS`.
        end: The counts of its commands; None: those that the rows show.
        name: Its name at the beginning of the line.
    """
    report, problem = _check(run)
    reason = (None if end is None else end.stopped) or run.stopped
    stopped = f"stopped: {_shorten(reason)}" if reason else "ran to its end"
    nearest = problem if report is None else "" if run.faults else f"; {_describe_nearest(report)}"
    missed = int(run.cycles["missed"].sum())
    answered = int((run.cycles["sent_ns"] != 0).sum())
    received = answered if end is None else end.received
    late = int(run.cycles["late"].max(initial=0)) if end is None else end.late
    counts = f"{plural(received, 'command')}, {late} late; {plural(missed, 'cycle')} without one"
    line = f"{name}, {run.setup.motion_kind}, {run.duration:.3f} s, {stopped}{nearest}; {counts}"
    lines = [line, ""]
    if reason:
        lines += [*(f"Stopped: {part}" for part in _parts(reason)), ""]
    if report is not None:
        lines += [*(f"Note: {note}" for note in report.motion.notes), str(report), ""]
    lines += _describe_commands(run, end, counts)
    lines += ["", "Settings in force (SI units):"]
    settings = {**({} if run.model is None else _describe_tool(run.model)), **run.setup.settings}
    lines += [f"  {name}: {_format(value)}" for name, value in settings.items()]
    return ClientReport(line=line, text="\n".join(lines) + "\n")


def check_client(run: Run) -> Report:
    """Returns the check of what a client commanded in a run, in its mode, without distances between links.

    Raises:
        InvalidValueError: The run does not name its arm or mode.
        UsageError: Nothing was commanded.
    """
    require_mode(run.setup.mode)
    return check_sent(run, distance=None)


def _check(run: Run) -> tuple[Report | None, str]:
    """Returns the check, or the reason why it is missing."""
    if len(run.cycles) < 2:
        return None, "; too short for a check"
    unknown = _count_unknown(run)
    if unknown:
        return None, f"; not checked: {unknown} played commands are not in the record"
    try:
        return check_client(run), ""
    except RcilabError as error:
        return None, f"; not checked: {error}"


def _count_unknown(run: Run) -> int:
    """Returns the number of played commands that are not in the record, without those before its beginning."""
    known, _ = played_commands(run.cycles)
    played = np.flatnonzero(run.cycles["played"])
    return int((played > known[0]).sum()) + 1 - len(known) if known.size else len(played)


def _describe_nearest(report: Report) -> str:
    """Returns the condition nearest to its bound; next to a range of positions also that nearest of all rates."""
    worst = report.worst
    if not worst.ok:
        return f"violates: {_describe_row(worst)}"
    rows = [worst]
    if worst.condition.order == 0:
        rates = [row for row in report.rows if row.necessity == "necessary" and row.condition.is_rate]
        rows += sorted(rates, key=lambda row: -row.ratio)[:1]
    return f"nearest limit{'s' * (len(rows) > 1)}: {' and '.join(map(_describe_row, rows))}"


def _describe_row(row: ConditionResult) -> str:
    return f"{row.condition.quantity} of {row.location}, {share(row.ratio)} of its bound at {row.time:.3f} s"


def _parts(reason: str | None) -> tuple[str, ...]:
    return reason.parts if isinstance(reason, Remark) else (reason,) if reason else ()


def _shorten(reason: str) -> str:
    first, *more = _parts(reason)
    return f"{first} (and {len(more)} more)" if more else first


def _format(value: object) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_format, cast("list[object]", value))) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _describe_tool(model: RobotModel) -> dict[str, object]:
    """Returns tool and load of an arm, as the settings of its controller."""
    load = model.load
    return {
        "tool": list(model.T_flange_tool.as_row_major()),
        "load_mass": load.mass,
        "load_center_of_mass": load.center_of_mass.tolist(),
        "load_inertia": load.inertia.tolist(),
    }


def _describe_commands(run: Run, end: MotionEnd | None, counts: str) -> list[str]:
    lines = [f"Commands of {run.setup.client or 'the client'}: {counts}"]
    if end is not None:
        lines.append(
            f"  most cycles in a row without one: {end.most_lost}; arrived twice: {end.duplicates}; "
            f"found the queue full: {end.dropped}"
        )
        if end.unrecorded:
            lines.append(f"  late or skipped, and not in the record: {end.unrecorded}")
    gaps = _find_gaps(run)
    if gaps:
        lines.append("  without commands: " + ", ".join(f"{count} ms at {start:.3f} s" for start, count in gaps[:10]))
    answered = run.cycles["sent_ns"] != 0
    if not run.realtime or not answered.any():
        return [*lines, "  in lock-step, times have no meaning"] if not run.realtime else lines
    answered &= np.isfinite(run.cycles["lateness"])
    if not answered.any():
        return [*lines, "  no command had the number of a recent state: there are no response times"]
    times = 1e3 * run.cycles["lateness"][answered]
    lines.append(
        f"  from state to command: median {np.median(times):.3f} ms, 99 % {np.percentile(times, 99):.3f} ms, "
        f"longest {times.max():.3f} ms at {run.t[answered][times.argmax()]:.3f} s"
    )
    return [*lines, *_histogram(times)]


def _find_gaps(run: Run) -> list[tuple[float, int]]:
    """Returns the beginnings of missed commands, [s], and the number of cycles of each, longest first."""
    edges = np.flatnonzero(np.diff((run.cycles["missed"] != 0).astype(np.int8), prepend=0, append=0))
    pairs = [(float(run.t[start]), int(stop - start)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
    return sorted(pairs, key=lambda pair: -pair[1])


def _histogram(times: np.ndarray) -> list[str]:
    counts = np.histogram(times, [0.0, *_EDGES, np.inf])[0]
    largest = max(int(counts.max()), 1)
    names = [f"below {_EDGES[0]:g} ms", *(f"{a:g} to {b:g} ms" for a, b in pairwise(_EDGES))]
    names.append(f"above {_EDGES[-1]:g} ms")
    rows = zip(names, counts.tolist(), strict=True)
    return [f"  {name:>14} {count:>8} {'#' * -(-_BAR * count // largest)}".rstrip() for name, count in rows if count]
