"""`rcilab check FILE`: checks a motion, a program or a recorded run, and writes a slowed motion that conforms."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.arm_options import (
    add_arm_options,
    add_cell_option,
    describe_arm,
    parse_box,
    parse_tool_and_load,
    read_cell,
)
from rcilab.cli.motion_file import HELP, add_max_rows, as_motion, read_file, resolved
from rcilab.cli.output import show
from rcilab.core.errors import InvalidValueError, RcilabError, UsageError
from rcilab.core.fault import name_faults
from rcilab.i18n.locale import LANGUAGES

if TYPE_CHECKING:
    from collections.abc import Callable

    from rcilab.cell.cell import Cell
    from rcilab.conformance.report import Report
    from rcilab.conformance.time_scaling import SlowDown
    from rcilab.core.safety_box import SafetyBox
    from rcilab.core.spatial import Pose
    from rcilab.core.state import Mode
    from rcilab.model.dynamics.payload import Payload
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion, Program
    from rcilab.recording.run import Run


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "check",
        help="check a saved motion, program or recorded run by the robot's conditions",
        description="Prints the report on a motion (.npz from Motion.save, .csv with times and joint angles), on the "
        "motion of a program (.json from Program.save), or on what the client of a recorded run (.rcirun) commanded: "
        "the joint angles, poses or torques as sent, up to the last or a refused one. Exit code: 0 it "
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
    add_cell_option(
        parser,
        "checks distances from its obstacles, with its tool and load, in place of --tool and --load; has the frames of "
        "waypoints",
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

    out: Path | None = args.slow_down
    if out is not None and os.path.realpath(out) == os.path.realpath(args.file):
        raise InvalidValueError("--slow-down", str(out), "is the file to check; choose another one")
    show_note = (lambda line: None) if args.json else show
    cell = read_cell(args.cell, args.tool, args.load)
    subject = _read_run(args) if args.file.suffix.lower() == ".rcirun" else _read_motion(args, cell)
    subject = subject.in_cell(cell)
    model = subject.model
    report, to_slow = _check(subject, args, show_note)
    arm = describe_arm(model, subject.box)
    for line in filter(None, (arm, subject.note)):
        show_note(f"note: {line}")
    is_explained = args.explain is not None and not report.ok and to_slow is not report
    slowed = to_slow.slow_down() if out is not None or is_explained else None
    if out is not None and slowed is not None and slowed.motion is not None:
        slowed.motion.save(out)
    if args.json:
        facts = {"model": model.name, "arm": arm, "note": subject.note}
        show(as_json_text({**facts, **report_as_json(report), **_slow_down_as_json(slowed, out)}))
    else:
        show(report if args.explain is None else report.explain(args.explain, slowed=slowed))
        if slowed is not None and out is not None:
            show(f"slow-down: {slowed}" if args.explain is None else slowed.explain(args.explain))
            if slowed.motion is not None:
                show(f"written: {args.slow_down}")
    conforms = report.ok if slowed is None or out is None else slowed.motion is not None
    return 0 if conforms else 1


def _check(subject: _Subject, args: Namespace, show_note: Callable[[str], None]) -> tuple[Report, Report]:
    """Returns the report and that on the motion to slow down, which must end at standstill; shows its notes."""
    from rcilab.conformance.check import check
    from rcilab.recording.run import Run
    from rcilab.recording.sent_motion import check_sent, recorded_mode, with_stop

    found, model, box, mode, cell = subject.found, subject.model, subject.box, subject.mode, subject.cell
    if not isinstance(found, Run):
        motion = as_motion(found, model, args.file, show=show_note, max_rows=args.max_rows, cell=cell)
        report = check(motion, model, box=box, cell=cell, mode=mode)
        return report, report
    report = check_sent(found, model, box=box, mode=mode, cell=cell)
    for note in report.motion.notes:
        show_note(f"note: {note}")
    is_refused = any(violation.condition.signal == "frame" for violation in report.violations)
    if (args.slow_down is None and args.explain is None) or is_refused or recorded_mode(found) == "torque":
        return report, report
    motion = with_stop(report.motion, model, mode)
    if len(motion) > len(report.motion) and not (report.ok and args.slow_down is None):
        before = report.motion.duration
        show_note(f"note: to slow it down, a stop of {motion.duration - before:.3f} s is added to the {before:.3f} s")
    start = None if found.truncated else report.start
    return report, check(motion, model, start=start, box=box, cell=cell, mode=mode)


_COMMAND_COLUMN, _LONGEST_HEADER = b"command[1]", 65536
_RUN_NOTE = (
    "the file is the table of a recorded run: its measured angles q are checked, without tool, load and box; the "
    ".rcirun file has the commands and all of these"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Subject:
    """What is checked, and for which arm."""

    found: Motion | Program | Run
    model: RobotModel
    box: SafetyBox | None
    mode: Mode
    cell: Cell | None = None
    note: str = ""

    def in_cell(self, cell: Cell | None) -> _Subject:
        """Returns the same in a cell, with a note if its tool or load are not those of the file."""
        from rcilab.cell.wire_rounding import without_rounding
        from rcilab.core.spatial import IDENTITY

        if cell is None:
            return self
        model, notes = cell.applied_to(self.model), [self.note] if self.note else []
        carries = not self.model.T_flange_tool.is_close(IDENTITY) or self.model.load.mass
        if carries and without_rounding(self.model, cell).fingerprint != model.fingerprint:
            notes.append("the file has another tool or load than the cell; those of the cell count")
        return replace(self, model=model, cell=cell, note="; ".join(notes))


def _read_motion(args: Namespace, cell: Cell | None) -> _Subject:
    from rcilab.model.robot_model import load_model
    from rcilab.motion import Program
    from rcilab.motion.program import box_numbers, payload_numbers, tool_numbers

    found = resolved(read_file(args.file, args.max_rows), cell, args.file)
    model_name = args.model
    if cell is not None and args.model is None and not isinstance(found, Program):
        model_name = cell.model
    named = found.model if isinstance(found, Program) and args.model is None else model_name
    tool, load, box = _arm_options(args, named)
    if isinstance(found, Program):
        found = replace(
            found,
            tool=found.tool if tool is None else tool_numbers(tool),
            payload=found.payload if load is None else payload_numbers(load),
            box=found.box if box is None else box_numbers(box),
        )
        model = found.applied_to(load_model(found.model if args.model is None else args.model))
        box = found.safety_box
    elif model_name is None:
        raise UsageError("a motion file does not name its arm: add --model NAME, such as --model xMatePro7")
    else:
        model = load_model(model_name, tool=tool, load=load)
        if found.n != model.n and args.file.suffix.lower() == ".csv":
            problem = f"has {found.n} joints after the time, {model.name} has {model.n}; is there a column t [s]?"
            raise InvalidValueError("motion file", args.file.name, problem)
    mode = args.mode or "joint_position"
    return _Subject(found=found, model=model, box=box, mode=mode, note=_RUN_NOTE if _is_run_table(args.file) else "")


def _is_run_table(path: Path) -> bool:
    """Returns whether a file is the table of a run, as `Run.save` writes it, which has more than its commands."""
    if path.suffix.lower() != ".csv":
        return False
    with path.open("rb") as file:
        return _COMMAND_COLUMN in file.readline(_LONGEST_HEADER)


def _read_run(args: Namespace) -> _Subject:
    from rcilab.model.robot_model import load_model
    from rcilab.recording.run import load_run
    from rcilab.recording.sent_motion import recorded_mode, with_soft_limits

    run = load_run(args.file, max_rows=args.max_rows)
    named = args.model or (None if run.model is None else run.model.name)
    tool, load, box = _arm_options(args, named)
    if run.model is None and args.model is None:
        raise UsageError("this run does not name its arm: add --model NAME, such as --model xMatePro7")
    model = run.model
    if model is None or args.model is not None:
        own = {} if model is None else {"tool": model.T_flange_tool, "load": model.load}
        model = load_model(args.model, **own)
    model = with_soft_limits(model, run)
    model = model if tool is None else model.with_tool(tool)
    model = model if load is None else model.with_load(load)
    notes: list[str] = []
    if run.model is not None and run.model.name != model.name:
        notes.append(f"the run is of the {run.model.name}, checked as one of the {model.name}")
    ended = str(run.stopped or name_faults(run.faults))
    if ended:
        notes.append(f"the run ended early: {ended}")
    if not run.is_complete:
        notes.append(f"the recording ends at {run.t[-1]:.3f} s: {run.missing_end}" if len(run.t) else run.missing_end)
    if run.truncated:
        notes.append("the beginning of the run is missing: the check begins in mid-motion")
    return _Subject(
        found=run,
        model=model,
        box=run.setup.safety_box if box is None else box,
        mode=args.mode or recorded_mode(run),
        note="; ".join(notes),
    )


def _arm_options(args: Namespace, model: str | None) -> tuple[Pose | None, Payload | None, SafetyBox | None]:
    """Returns tool, load and safety box; `model` is the name of the arm, if it is known."""
    box = None if args.box is None else parse_box(args.box)
    return *parse_tool_and_load(args.tool, args.load, model), box


def _slow_down_as_json(slowed: SlowDown | None, file: Path | None) -> dict[str, Any]:
    if slowed is None:
        return {}
    written = None if slowed.motion is None else str(file)
    return {"slow_down": {"factor": slowed.factor, "written": written, "text": str(slowed)}}
