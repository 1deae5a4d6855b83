"""`rcilab doctor`: is this machine fit to plan, to simulate, and to stream at 1 kHz? One line a question."""

from __future__ import annotations

import argparse
import json
import sys

from rcilab.core.errors import InvalidValueError
from rcilab.diagnostics.doctor.finding import Finding, summary

DESCRIPTION = """\
Says what this machine lacks, and the exact remedy. "ok": nothing to do; "note": works, with a drawback; "bad": a part
of rcilab does not work. Ends with 1 when something is bad, else with 0. Nothing is changed, and nothing moves.
"""
LONGEST = 3600.0  # [s]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab doctor`."""
    parser = subparsers.add_parser(
        "doctor", help="say what this machine lacks for planning, simulating and streaming", description=DESCRIPTION
    )
    parser.add_argument("--robot", metavar="rci://HOST:PORT", help="look for the way to this robot too")
    parser.add_argument(
        "--seconds", type=float, default=10.0, metavar="S", help="how long to measure jitter (%(default)g); 0: not"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON list, an entry a finding")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints every finding as it is found; returns 1 when something does not work, else 0."""
    from rcilab.diagnostics.doctor.run_checks import examine
    from rcilab.diagnostics.doctor.system import System
    from rcilab.makers.driver import parse_address

    if not 0.0 <= args.seconds <= LONGEST:
        raise InvalidValueError("--seconds", args.seconds, f"must be from 0 to {LONGEST:g} s")
    robot = None if args.robot is None else parse_address(args.robot)
    shown = Progress(args.seconds)
    findings: list[Finding] = []
    for finding in examine(System(), robot=robot, seconds=args.seconds, progress=shown):
        findings.append(finding)
        shown.clear()
        if not args.json:
            print(finding, flush=True)
    if args.json:
        print(json.dumps([finding.as_json() for finding in findings], indent=1))
    else:
        print(f"\n{summary(findings)}")
    return 1 if any(finding.verdict == "bad" for finding in findings) else 0


class Progress:
    """How far a measurement is, on stderr: one line that rewrites itself on a terminal, else a line a second.

    Args:
        seconds: How long it takes, [s].
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._rewrites = sys.stderr.isatty()
        self._width = 0

    def __call__(self, spent: float, worst: float) -> None:
        """Shows the time spent so far and the largest lateness so far, [s]."""
        line = f"measuring jitter: {spent:.0f} of {self._seconds:g} s, longest so far {1e6 * worst:.0f} us"
        self._width = len(line)
        print(f"\r{line}" if self._rewrites else line, end="" if self._rewrites else "\n", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Takes the line away again where it can."""
        if self._rewrites and self._width:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)
        self._width = 0
