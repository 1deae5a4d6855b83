"""`rcilab check FILE`: checks a motion, a program or a recorded run, and writes a slowed motion that conforms."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.arm_options import add_arm_options, describe_arm, parse_box, parse_load, parse_tool
from rcilab.cli.motion_file import HELP, add_max_rows, as_motion, read_file
from rcilab.cli.output import show
from rcilab.core.errors import InvalidValueError, RcilabError, UsageError
from rcilab.core.fault import name_faults
from rcilab.i18n.locale import LANGUAGES

if TYPE_CHECKING:
    from rcilab.conformance.time_scaling import SlowDown
    from rcilab.core.arrays import Array, JointVector
    from rcilab.core.safety_box import SafetyBox
    from rcilab.core.spatial import Pose
    from rcilab.core.state import Mode
    from rcilab.model.dynamics.payload import Payload
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion, Program


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "check",
        help="check a saved motion, program or recorded run by the robot's conditions",
        description="Prints the report on a motion (.npz from Motion.save, .csv with times and joint angles), on the "
        "motion of a program (.json from Program.save), or on what the client of a recorded run (.rcirun) commanded: "
        "the joint angles or torques as sent, or for poses the angles that the controller commanded. Exit code: 0 it "
        "conforms, or the written motion does; 1 it does not; 2 the file or the model name is not valid, or the "
        "program cannot be planned.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=f"{HELP}, or recorded run (.rcirun)")
    parser.add_argument(
        "--model",
        metavar="NAME",
        help="arm, such as xMatePro7 (any case), or its file my_arm.json; default: that of the program or the run",
    )
    add_arm_options(parser)
    parser.add_argument(
        "--slow-down",
        type=Path,
        metavar="OUT",
        help="also write the motion (.npz or .csv), slowed by the smallest factor that conforms; nothing if none does",
    )
    parser.add_argument(
        "--mode",
        metavar="MODE",
        help="command mode, which determines the conditions: joint_position, cartesian_position, torque ...; default: "
        "that of a recorded run, else joint_position",
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
    from rcilab.conformance.check import check, check_torques

    out: Path | None = args.slow_down
    if out is not None and os.path.realpath(out) == os.path.realpath(args.file):
        raise InvalidValueError("--slow-down", str(out), "is the file to check; choose another one")
    show_note = (lambda line: None) if args.json else show
    subject = _read_run(args) if args.file.suffix.lower() == ".rcirun" else _read_motion(args)
    model = subject.model
    motion = as_motion(subject.found, model, args.file, show=show_note, max_rows=args.max_rows)
    arm = describe_arm(model, subject.box)
    for line in filter(None, (arm, subject.note)):
        show_note(f"note: {line}")
    if subject.torques is None:
        report = check(motion, model, start=subject.start, box=subject.box, mode=subject.mode)
    else:
        report = check_torques(motion, subject.torques, model, start=subject.start, box=subject.box)
    slowed = None if out is None else report.slow_down()
    if out is not None and slowed is not None and slowed.motion is not None:
        slowed.motion.save(out)
    if args.json:
        facts = {"model": model.name, "arm": arm, "note": subject.note}
        show(as_json_text({**facts, **report_as_json(report), **_slow_down_as_json(slowed, out)}))
    else:
        show(report if args.explain is None else report.explain(args.explain))
        if slowed is not None:
            show(f"slow-down: {slowed}" if args.explain is None else slowed.explain(args.explain))
            if slowed.motion is not None:
                show(f"written: {args.slow_down}")
    conforms = report.ok if slowed is None else slowed.motion is not None
    return 0 if conforms else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class _Subject:
    """What is checked, and for which arm."""

    found: Motion | Program
    model: RobotModel
    box: SafetyBox | None
    mode: Mode
    start: JointVector | None = None
    """Commanded joint angles before the first command, [rad]; None: those of the motion's start."""
    torques: Array | None = None
    """Commanded torques, one row for each of the motion, [N m]."""
    note: str = ""


def _read_motion(args: Namespace) -> _Subject:
    from rcilab.model.robot_model import load_model
    from rcilab.motion import Program
    from rcilab.motion.program import box_numbers, payload_numbers, tool_numbers

    found = read_file(args.file, args.max_rows)
    tool, load, box = _arm_options(args)
    if isinstance(found, Program):
        found = replace(
            found,
            tool=found.tool if tool is None else tool_numbers(tool),
            payload=found.payload if load is None else payload_numbers(load),
            box=found.box if box is None else box_numbers(box),
        )
        model = found.applied_to(load_model(found.model if args.model is None else args.model))
        box = found.safety_box
    elif args.model is None:
        raise UsageError("a motion file does not name its arm: add --model NAME, such as --model xMatePro7")
    else:
        model = load_model(args.model, tool=tool, load=load)
    return _Subject(found=found, model=model, box=box, mode=args.mode or "joint_position")


def _read_run(args: Namespace) -> _Subject:
    from rcilab.core.state import MODES
    from rcilab.model.robot_model import load_model
    from rcilab.recording.run import load_run
    from rcilab.recording.sent_motion import sent_motion, sent_torques, start_of, with_stop

    run = load_run(args.file, max_rows=args.max_rows)
    tool, load, box = _arm_options(args)
    if run.model is None and args.model is None:
        raise UsageError("this run does not name its arm: add --model NAME, such as --model xMatePro7")
    model = run.model
    if model is None or args.model is not None:
        own = {} if model is None else {"tool": model.T_flange_tool, "load": model.load}
        model = load_model(args.model, **own)
    model = model if tool is None else model.with_tool(tool)
    model = model if load is None else model.with_load(load)
    recorded = run.setup.mode if run.setup.mode in MODES else "joint_position"
    motion, torques = sent_torques(run) if recorded == "torque" else (sent_motion(run), None)
    ended = str(run.stopped or name_faults(run.faults))
    notes = [f"the run ended early: {ended}"] if ended else []
    if torques is None and (continued := with_stop(motion, model, recorded)) is not motion:
        notes.append(f"after its last command at t = {motion.duration:.3f} s, which still moves, a stop is added")
        motion = continued
    if run.truncated:
        notes.append("the beginning of the run is missing, so that the motion begins with a jump")
    return _Subject(
        found=motion,
        model=model,
        box=run.setup.safety_box if box is None else box,
        mode=args.mode or recorded,
        start=start_of(run),
        torques=torques,
        note="; ".join(notes),
    )


def _arm_options(args: Namespace) -> tuple[Pose | None, Payload | None, SafetyBox | None]:
    return (
        None if args.tool is None else parse_tool(args.tool),
        None if args.load is None else parse_load(args.load),
        None if args.box is None else parse_box(args.box),
    )


def _slow_down_as_json(slowed: SlowDown | None, file: Path | None) -> dict[str, Any]:
    if slowed is None:
        return {}
    written = None if slowed.motion is None else str(file)
    return {"slow_down": {"factor": slowed.factor, "written": written, "text": str(slowed)}}
