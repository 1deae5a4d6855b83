"""`rcilab run FILE --robot rci://...`: a saved motion or program on a robot, after its report and a yes."""

from __future__ import annotations

import math
import signal
import sys
import threading
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.motion_file import HELP, as_motion, read_file
from rcilab.errors import UsageError

if TYPE_CHECKING:
    from rcilab.client import RobotSession, Run
    from rcilab.conformance import Certificate
    from rcilab.motion import Motion

_DONE, _NOT_DONE = 0, 1
_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # Ctrl-C, kill, a terminal that was closed.


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "run",
        help="run a saved motion or program on a robot",
        description="Judges a motion saved with Motion.save, or that of a program saved with Program.save, shows the "
        "report, asks for a yes, runs it. Exit code: "
        "0 it ran to its end, 1 it does not conform, nobody said yes or it was stopped, 2 bad input, no robot or a "
        "fault of the robot.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=HELP)
    parser.add_argument("--robot", required=True, metavar="ADDRESS", help="rci://HOST:PORT")
    parser.add_argument("--model", metavar="NAME", help="arm, such as xMatePro7; asked of the robot when left out")
    parser.add_argument("--yes", action="store_true", help="do not ask; for scripts that have asked already")
    parser.add_argument("--timeout", type=float, default=3.0, metavar="S", help="for every answer of the robot [s]")
    parser.set_defaults(run=run)


def run(args: Namespace) -> int:
    """Runs the motion and returns the exit code.

    Raises:
        RcilabError: Bad input, no robot, or a fault; the caller prints it and exits with 2.
    """
    with _stopping_on_signals() as stopper:
        try:
            return _run(args, stopper)
        except KeyboardInterrupt:
            print("\nNothing was sent.", file=sys.stderr)
            return _NOT_DONE


class _Stopper:
    """What a signal does: before the motion it ends the command, in the motion it brings the arm to rest."""

    def __init__(self) -> None:
        self._robot: RobotSession | None = None
        self._is_asked = False

    def execute(self, robot: RobotSession, motion: Motion, certificate: Certificate | None) -> Run:
        """Runs the motion, or the part of it up to a signal."""
        self._robot = robot
        return robot.execute(motion, certificate, progress=lambda t, duration: self._insist())

    def on_signal(self, number: int, frame: object) -> None:
        """Serves a signal, between two steps of the main thread."""
        if self._robot is None:
            raise KeyboardInterrupt
        self._is_asked = True
        self._robot.stop()

    def _insist(self) -> None:
        """Stops for a signal that came after the start was decided and before anything moved."""
        if self._is_asked and self._robot is not None:
            self._robot.stop()


@contextmanager
def _stopping_on_signals() -> Iterator[_Stopper]:
    stopper = _Stopper()
    if threading.current_thread() is not threading.main_thread():  # Only there can signals be served.
        yield stopper
        return
    before = {number: signal.signal(number, stopper.on_signal) for number in _STOP_SIGNALS}
    try:
        yield stopper
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(args: Namespace, stopper: _Stopper) -> int:
    from rcilab.client import connect
    from rcilab.client.start_check import describe_start_mismatch
    from rcilab.conformance import check
    from rcilab.model import load_model

    found = read_file(args.file)
    model = load_model(args.model) if args.model else None
    with connect(args.robot, model, args.timeout) as robot:
        motion = as_motion(found, robot.model)
        start = robot.state.q_c
        mismatch = describe_start_mismatch(motion.q[0], start)
        if mismatch is not None:  # Before the report: every one of its violations would only say this again.
            raise UsageError(mismatch)
        report = check(motion, robot.model, start=start)
        print(report)
        if not report.ok:
            print("The motion does not conform; nothing was sent.", file=sys.stderr)
            return _NOT_DONE
        print(_what_will_move(motion, robot))
        if not args.yes and not _agreed():
            return _NOT_DONE
        if not robot.motor_state():
            robot.power_on()
        result = stopper.execute(robot, motion, report.certificate)
    print(result, flush=True)
    if result.stopped:
        print(
            f"stopped {result.stopped} at t = {result.duration:.2f} s; the arm is at rest; plan the next motion from "
            "where it is (robot.state.q_c)",
            file=sys.stderr,
        )
    return _NOT_DONE if result.stopped else _DONE


def _what_will_move(motion: Motion, robot: RobotSession) -> str:
    from rcilab.motion.extent import measure_extent

    extent = measure_extent(motion, robot.model)
    return (
        f"{robot.model.name} at {robot.address} will move for {extent.duration:.2f} s. "
        f"Joints {extent.describe_joints() or 'stay'}. "
        f"The tool goes up to {1e3 * extent.tool_distance:.0f} mm from where it is. "
        f"Top speeds: joint {extent.fastest_joint} with {math.degrees(extent.joint_speed):.1f}°/s, "
        f"the tool with {extent.tool_speed:.2f} m/s."
    )


def _agreed() -> bool:
    try:
        answer = input("Keep clear of the arm and the emergency stop at hand. Move it? Type yes: ").strip()
    except EOFError:
        print("\nNothing was sent.", file=sys.stderr)
        return False
    if answer != "yes":
        print(f"{'' if sys.stdin.isatty() else chr(10)}{answer!r} is not 'yes': nothing was sent.", file=sys.stderr)
    return answer == "yes"
