"""`rcilab run FILE --robot rci://...`: a saved motion on a robot, after its report and an explicit yes."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rcilab.client import RobotSession
    from rcilab.motion import Motion

_DONE, _NOT_DONE = 0, 1


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "run",
        help="run a saved motion on a robot",
        description="Judges a motion saved with Motion.save, shows the report, asks for a yes, runs it. Exit code: "
        "0 it ran to its end, 1 it does not conform, nobody said yes or it was stopped, 2 bad input, no robot or a "
        "fault of the robot.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="motion file (.npz)")
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
    from rcilab.client import connect
    from rcilab.conformance import check
    from rcilab.model import load_model
    from rcilab.motion import Motion

    motion = Motion.load(args.file)
    model = load_model(args.model) if args.model else None
    with connect(args.robot, model, args.timeout) as robot:
        report = check(motion, robot.model, start=robot.state.q_c)
        print(report)
        if not report.ok:
            print("The motion does not conform; nothing was sent.", file=sys.stderr)
            return _NOT_DONE
        print(_what_will_move(motion, robot))
        if not args.yes and not _agreed():
            print("Nothing was sent.", file=sys.stderr)
            return _NOT_DONE
        if not robot.get_motor_state():
            robot.power_on()
        result = robot.execute(motion, report.certificate)
    print(result)
    return _NOT_DONE if result.stopped else _DONE


def _what_will_move(motion: Motion, robot: RobotSession) -> str:
    travel = abs(motion.goal - motion.q[0])
    joint = int(travel.argmax())
    return (
        f"{robot.model.name} at {robot.address} will move for {motion.duration:.2f} s; "
        f"joint {joint + 1} the farthest, by {math.degrees(travel[joint]):.1f} deg."
    )


def _agreed() -> bool:
    try:
        return input("Keep clear of the arm and the emergency stop at hand. Move it? Type yes: ").strip() == "yes"
    except EOFError:
        print(file=sys.stderr)
        return False
