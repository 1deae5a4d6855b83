"""`rcilab bench`: how fast this machine is, beside what we promise."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from contextlib import redirect_stdout
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rcilab.core.errors import UsageError
from rcilab.diagnostics.bench.rows import ROWS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rcilab.diagnostics.bench.cpu_speed_monitor import CpuSpeedMonitor
    from rcilab.diagnostics.bench.measure import Absent, Measurement

BENCHES = tuple(ROWS)
"""In the order they run; the slow ones last."""
COMPARE = "compare"
"""Runs only when it is named: what it measures are others' packages."""

EPILOG = """compare: the same tasks done by rcilab, ssik, pinocchio, pink and toppra, on the same poses and lines of an
xMatePro7, in processor time of one process. Its rows are named TASK/WHO:
  home      one answer of the inverse to a random reachable pose, asked from the home pose
  near      the same with the arm 0.1 rad away in every joint
  branches  every answer at 16 arm angles
  line      the timing of a straight line
They promise nothing and are not part of the default. What is not installed is a row that says what to install;
pip install -e '.[compare]' in a checkout installs all of it.

examples:
  rcilab bench inverse plan_line
  rcilab bench compare --json"""

_STREAMING = 30.0  # [s]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab bench`."""
    parser = subparsers.add_parser(
        "bench",
        help="measure this machine beside what we promise",
        description="Measures how fast rcilab is on this machine, one row a task, beside what we promise.\n"
        "Exit code: 0 every promise is kept, 1 one is not, 2 a name is unknown.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    known = f"one or more of: {', '.join(BENCHES)} (default: all of these); or {COMPARE}: us beside others' packages"
    parser.add_argument("names", nargs="*", metavar="NAME", help=known)
    parser.add_argument("--json", action="store_true", help="print one JSON list instead of a table")
    parser.add_argument(
        "--seconds",
        type=float,
        default=_STREAMING,
        help="how long control_loop and spectators stream, [s] (default: %(default)s)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measures and prints, the machine first; returns 1 when a promise is not kept, else 0.

    Raises:
        UsageError: A bench is unknown, or the time is no time.
    """
    names = _chosen(args.names)
    if not 0.5 <= args.seconds <= 600.0:
        raise UsageError(f"--seconds {args.seconds:g} is not from 0.5 to 600 s")
    from rcilab.diagnostics.bench.machine import describe_machine

    machine = describe_machine()
    if args.json:
        print("[\n" + json.dumps(machine), end="", flush=True)
    else:
        _print_machine(machine)
    from rcilab.diagnostics.bench.cpu_speed_monitor import CpuSpeedMonitor

    kept, out, pace = True, sys.stdout, CpuSpeedMonitor()
    for name in names:
        if not args.json and sys.stderr.isatty():
            print(f"{name} ...", end="\r", file=sys.stderr, flush=True)
        with redirect_stdout(sys.stderr), pace:  # What libraries have to say is no part of the list.
            for found in _measured(name, args.seconds):
                kept = kept and found.ok is not False
                found = replace(found, note=_with_pace(found.note, pace))
                if args.json:
                    print(",\n" + json.dumps(found.as_json()), end="", file=out, flush=True)
                else:
                    print(_row(found), file=out, flush=True)
    if args.json:
        print("\n]")
    return 0 if kept else 1


def _chosen(names: list[str]) -> list[str]:
    known = (*BENCHES, COMPARE)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise UsageError(f"unknown bench {unknown[0]!r}; known: {', '.join(known)}")
    return [name for name in known if name in (names or BENCHES)]


def _measured(name: str, seconds: float) -> Iterable[Measurement | Absent]:
    """Returns the rows of one name; most have a single one."""
    if name == COMPARE:
        from rcilab.diagnostics.bench.compare.comparison import compare

        return compare()
    from rcilab.diagnostics.bench.isolated_run import measure_apart

    return (measure_apart(name, seconds),)


def _with_pace(note: str, pace: CpuSpeedMonitor) -> str:
    """Returns the note of a row, with a word about the machine where that was slow meanwhile."""
    from rcilab.diagnostics.bench.cpu_speed_monitor import SLOW

    slowness = pace.slowness
    if slowness < SLOW:
        return note
    word = f"meanwhile this machine took {slowness:.1f} times as long for the same Python as at its best"
    return f"{note}; {word}" if note else word


def _print_machine(machine: dict[str, Any]) -> None:
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    fifo = "in force" if machine["sched_fifo"] else "NOT permitted"
    print(f"{machine['cpu']}, {machine['cores']} cores, load {machine['load']}; {machine['kernel']}; SCHED_FIFO {fifo}")
    print(f"Python {machine['python']}, {versions}")
    print(f"\n{'':4} {'bench':20} {'median':>10} {'p99':>10} {'target':>10}")


def _row(found: Measurement | Absent) -> str:
    from rcilab.diagnostics.bench.measure import Absent, plain

    verdict = {True: "ok", False: "SLOW", None: "-"}[found.ok]
    if isinstance(found, Absent):
        verdict = "FAIL" if found.ok is False else verdict
        numbers = f"{verdict:4} {found.name:20} {'-':>10} {'-':>10} {'-':>10}"
    else:
        target = "-" if found.target is None else f"{found.target:g}"
        median, p99 = plain(found.median), plain(found.p99)
        numbers = f"{verdict:4} {found.name:20} {median:>10} {p99:>10} {target:>10} {found.unit}"
    return numbers + "\n" + textwrap.fill(found.note, 110, initial_indent=" " * 7, subsequent_indent=" " * 7)
