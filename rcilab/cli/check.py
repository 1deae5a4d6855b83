"""`rcilab check FILE --model NAME`: checks a motion or program in a file, and writes a slowed motion that conforms."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.motion_file import HELP, add_max_rows, as_motion, read_file
from rcilab.cli.output import show
from rcilab.core.errors import InvalidValueError, RcilabError, UsageError
from rcilab.i18n.locale import LANGUAGES

if TYPE_CHECKING:
    from rcilab.conformance.time_scaling import SlowDown


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "check",
        help="check a saved motion or program by the robot's conditions",
        description="Prints the report on a motion (.npz from Motion.save, .csv with times and joint angles) or on the "
        "motion of a program (.json from Program.save). Exit code: 0 it conforms, or the written motion does; 1 it "
        "does not; 2 the file or the model name is not valid, or the program cannot be planned.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=HELP)
    parser.add_argument(
        "--model", metavar="NAME", help="arm, such as xMatePro7 (any case); default for a program: its own"
    )
    parser.add_argument(
        "--slow-down",
        type=Path,
        metavar="OUT",
        help="also write the motion (.npz or .csv), slowed by the smallest factor that conforms; nothing if none does",
    )
    parser.add_argument(
        "--mode",
        metavar="MODE",
        default="joint_position",
        help="command mode, which determines the conditions: %(default)s, cartesian_position, torque ...",
    )
    add_max_rows(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--explain", choices=tuple(LANGUAGES), help="print sentences, in English or Chinese")
    form.add_argument(
        "--json", action="store_true", help="print one JSON object instead, also about an error; SI units"
    )
    parser.set_defaults(run=run)


def run(args: Namespace) -> int:
    """Prints the report and returns 0 if the motion, or the slowed one that it writes, conforms, else 1.

    Raises:
        RcilabError: Bad input; the caller prints it and exits with 2.
    """
    from rcilab.cli.report_json import as_json_text, error_as_json

    try:
        return _run(args)
    except RcilabError as error:
        if args.json:
            show(as_json_text({"model": args.model, "ok": False, "error": error_as_json(error)}))
        raise


def _run(args: Namespace) -> int:
    from rcilab.cli.report_json import as_json_text, report_as_json
    from rcilab.conformance.check import check
    from rcilab.model.robot_model import load_model
    from rcilab.motion import Program

    out: Path | None = args.slow_down
    if out is not None and os.path.realpath(out) == os.path.realpath(args.file):
        raise InvalidValueError("--slow-down", str(out), "is the file to check; choose another one")
    found = read_file(args.file, args.max_rows)
    name = found.model if args.model is None and isinstance(found, Program) else args.model
    if name is None:
        raise UsageError("a motion file does not name its arm: add --model NAME, such as --model xMatePro7")
    model = load_model(name, tool=found.T_flange_tool if isinstance(found, Program) else None)
    motion = as_motion(found, model, args.file, show=(lambda line: None) if args.json else show, max_rows=args.max_rows)
    report = check(motion, model, mode=args.mode)
    slowed = None if out is None else report.slow_down()
    if out is not None and slowed is not None and slowed.motion is not None:
        slowed.motion.save(out)
    if args.json:
        show(as_json_text({"model": model.name, **report_as_json(report), **_slow_down_as_json(slowed, out)}))
    else:
        show(report if args.explain is None else report.explain(args.explain))
        if slowed is not None:
            show(f"slow-down: {slowed}" if args.explain is None else slowed.explain(args.explain))
            if slowed.motion is not None:
                show(f"written: {args.slow_down}")
    conforms = report.ok if slowed is None else slowed.motion is not None
    return 0 if conforms else 1


def _slow_down_as_json(slowed: SlowDown | None, file: Path | None) -> dict[str, Any]:
    if slowed is None:
        return {}
    written = None if slowed.motion is None else str(file)
    return {"slow_down": {"factor": slowed.factor, "written": written, "text": str(slowed)}}
