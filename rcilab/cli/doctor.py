"""`rcilab doctor`: checks whether this machine can plan, simulate, and stream at 1 kHz, one line per check."""

from __future__ import annotations

import argparse
import json
import sys

from rcilab.cli.output import show
from rcilab.core.errors import InvalidValueError
from rcilab.diagnostics.doctor.finding import Finding, summary

DESCRIPTION = """\
Reports what this machine is missing, with the remedy. "ok": nothing to do; "note": works, with a drawback; "bad": a
part of rcilab does not work. Exit code: 1 if something is bad, else 0. Nothing is changed, and nothing moves.
"""
MAX_SECONDS = 3600.0  # [s]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab doctor`."""
    parser = subparsers.add_parser(
        "doctor", help="check this machine for planning, simulating and streaming", description=DESCRIPTION
    )
    parser.add_argument("--robot", metavar="SCHEME://HOST", help="also check the network route to this robot")
    parser.add_argument(
        "--seconds",
        type=float,
        default=10.0,
        metavar="S",
        help="duration of the jitter measurement (%(default)g); 0: none",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON list, one entry per finding")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints the findings; returns 1 if something does not work, else 0."""
    from rcilab.diagnostics.doctor.run_checks import run_checks
    from rcilab.diagnostics.doctor.system import System
    from rcilab.makers.driver import parse_address

    if not 0.0 <= args.seconds <= MAX_SECONDS:
        raise InvalidValueError("--seconds", args.seconds, f"must be from 0 to {MAX_SECONDS:g} s")
    robot = None if args.robot is None else parse_address(args.robot)
    shown = Progress(args.seconds)
    findings: list[Finding] = []
    for finding in run_checks(System(), robot=robot, seconds=args.seconds, progress=shown):
        findings.append(finding)
        shown.clear()
        if not args.json:
            show(finding)
    if args.json:
        show(json.dumps([finding.as_json() for finding in findings], indent=1))
    else:
        show(f"\n{summary(findings)}")
    return 1 if any(finding.verdict == "bad" for finding in findings) else 0


class Progress:
    """Progress of a measurement on stderr: on a terminal one line that is rewritten, else one line per second.

    Args:
        seconds: Duration of the measurement, [s].
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._rewrites = sys.stderr.isatty()
        self._width = 0

    def __call__(self, spent: float, worst: float) -> None:
        """Prints the elapsed time and the largest lateness so far, [s]."""
        line = f"measuring jitter: {spent:.0f} of {self._seconds:g} s, longest so far {1e6 * worst:.0f} us"
        self._width = len(line)
        print(f"\r{line}" if self._rewrites else line, end="" if self._rewrites else "\n", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Erases the line on a terminal."""
        if self._rewrites and self._width:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)
        self._width = 0
