"""`rcilab bench`: measures the speed of this machine against the targets."""

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
"""In the order of execution; the slow ones are last."""
COMPARE = "compare"
"""Runs only if it is named, because it measures other packages."""

EPILOG = """compare: the same tasks with rcilab, ssik, pinocchio, pink and toppra, on the same poses and lines of an
xMatePro7, in processor time of one process. Its rows are named TASK/PACKAGE:
  home      one inverse kinematics solution of a random reachable pose, starting at the home pose
  near      the same, starting 0.1 rad away in every joint
  branches  all solutions at 16 arm angles
  line      the timing of a straight line
These rows have no targets and do not run by default. The row of a package that is not installed says what to install;
pip install -e '.[compare]' in a checkout installs all of them.

examples:
  rcilab bench inverse plan_line
  rcilab bench compare --json"""

_STREAMING = 30.0  # [s]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab bench`."""
    parser = subparsers.add_parser(
        "bench",
        help="measure this machine against the targets",
        description="Measures how fast rcilab is on this machine, one row per task, against the targets.\n"
        "Exit code: 0 every target is met, 1 one is not, 2 a name is unknown.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    known = f"one or more of: {', '.join(BENCHES)} (default: all of these); or {COMPARE}: rcilab and other packages"
    parser.add_argument("names", nargs="*", metavar="NAME", help=known)
    parser.add_argument("--json", action="store_true", help="print one JSON list instead of a table")
    parser.add_argument(
        "--seconds",
        type=float,
        default=_STREAMING,
        help="duration of streaming in control_loop and spectators, [s] (default: %(default)s)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints the machine and the measurements; returns 1 if a target is not met, else 0.

    Raises:
        UsageError: A bench is unknown, or the duration is out of range.
    """
    names = _requested(args.names)
    if not 0.5 <= args.seconds <= 600.0:
        raise UsageError(f"--seconds must be from 0.5 to 600 s, got {args.seconds:g}")
    from rcilab.diagnostics.bench.machine import describe_machine

    machine = describe_machine()
    if args.json:
        print("[\n" + json.dumps(machine), end="", flush=True)
    else:
        _print_machine(machine)
    from rcilab.diagnostics.bench.cpu_speed_monitor import CpuSpeedMonitor

    is_met, out, speed = True, sys.stdout, CpuSpeedMonitor()
    for name in names:
        if not args.json and sys.stderr.isatty():
            print(f"{name} ...", end="\r", file=sys.stderr, flush=True)
        with redirect_stdout(sys.stderr), speed:  # Output of libraries does not belong to the list.
            for found in _measure(name, args.seconds):
                is_met = is_met and found.ok is not False
                found = replace(found, note=_with_slowdown(found.note, speed))
                if args.json:
                    print(",\n" + json.dumps(found.as_json()), end="", file=out, flush=True)
                else:
                    print(_row(found), file=out, flush=True)
    if args.json:
        print("\n]")
    return 0 if is_met else 1


def _requested(names: list[str]) -> list[str]:
    known = (*BENCHES, COMPARE)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise UsageError(f"unknown bench {unknown[0]!r}; known: {', '.join(known)}")
    return [name for name in known if name in (names or BENCHES)]


def _measure(name: str, seconds: float) -> Iterable[Measurement | Absent]:
    if name == COMPARE:
        from rcilab.diagnostics.bench.compare.comparison import compare

        return compare()
    from rcilab.diagnostics.bench.isolated_run import measure_isolated

    return (measure_isolated(name, seconds),)


def _with_slowdown(note: str, speed: CpuSpeedMonitor) -> str:
    """Returns the note of a row; adds the slowdown if the machine was slow during the measurement."""
    from rcilab.diagnostics.bench.cpu_speed_monitor import SLOW

    slowness = speed.slowness
    if slowness < SLOW:
        return note
    slowdown = (
        f"during this measurement the machine took {slowness:.1f} times as long for the same Python as at its best"
    )
    return f"{note}; {slowdown}" if note else slowdown


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
