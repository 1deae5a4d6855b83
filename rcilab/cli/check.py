"""`rcilab check FILE --model NAME`: the report on a motion or program in a file, and a slowed motion that passes."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from rcilab.cli.motion_file import HELP, as_motion, read_file
from rcilab.errors import UsageError
from rcilab.language import LANGUAGES


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "check",
        help="judge a saved motion or program by the robot's conditions",
        description="Prints the report on a motion saved with Motion.save, or on that of a program saved with "
        "Program.save. Exit code: 0 it conforms, or what was written does; 1 it does not; 2 the file or the model name "
        "is no good, or the program cannot be planned.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=HELP)
    parser.add_argument(
        "--model", metavar="NAME", help="arm, such as xMatePro7 (any case); a program names its own when left out"
    )
    parser.add_argument(
        "--slow-down",
        type=Path,
        metavar="OUT",
        help="also write the motion (.npz), slowed down by the least factor that passes; nothing when none does",
    )
    parser.add_argument(
        "--mode",
        metavar="MODE",
        default="joint_position",
        help="how it will be sent, which decides what is judged: %(default)s, cartesian_position, torque ...",
    )
    parser.add_argument("--explain", choices=tuple(LANGUAGES), help="say it in whole sentences, in English or Chinese")
    parser.set_defaults(run=run)


def run(args: Namespace) -> int:
    """Prints the report and returns 0 if the motion, or the slowed one that it writes, conforms, else 1.

    Raises:
        RcilabError: Bad input; the caller prints it and exits with 2.
    """
    from rcilab.conformance import check
    from rcilab.model import load_model
    from rcilab.motion import Program

    found = read_file(args.file)
    name = found.model if args.model is None and isinstance(found, Program) else args.model
    if name is None:
        raise UsageError("a motion does not say for which arm it is: add --model NAME, such as --model xMatePro7")
    model = load_model(name, tool=found.T_flange_tool if isinstance(found, Program) else None)
    report = check(as_motion(found, model), model, mode=args.mode)
    print(report if args.explain is None else report.explain(args.explain))
    if args.slow_down is None:
        return 0 if report.ok else 1
    slowed = report.slow_down()
    print(f"slow-down: {slowed}" if args.explain is None else slowed.explain(args.explain))
    if slowed.motion is None:
        return 1
    slowed.motion.save(args.slow_down)
    print(f"written: {args.slow_down}")
    return 0
