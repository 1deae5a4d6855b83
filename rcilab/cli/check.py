"""`rcilab check FILE --model NAME`: the report on a motion in a file, and the motion slowed down until it passes."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from rcilab.language import LANGUAGES


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "check",
        help="judge a saved motion by the robot's conditions",
        description="Prints the report on a motion saved with Motion.save. Exit code: 0 it conforms, or what was "
        "written does; 1 it does not; 2 the file or the model name is no good.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="motion file (.npz)")
    parser.add_argument("--model", required=True, metavar="NAME", help="arm, such as xMatePro7 (any case)")
    parser.add_argument(
        "--slow-down",
        type=Path,
        metavar="OUT",
        help="also write the motion (.npz), slowed down by the least factor that passes; nothing when none does",
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
    from rcilab.motion import Motion

    model = load_model(args.model)
    report = check(Motion.load(args.file), model)
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
