"""`rcilab run FILE --robot rci://...`: runs a saved motion or program on a robot, after a report and a confirmation."""

from __future__ import annotations

import math
import signal
import sys
import threading
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TextIO

from rcilab.cli.arm_options import add_cell_option, read_cell
from rcilab.cli.motion_file import HELP, add_max_rows, as_motion, read_file, resolved
from rcilab.cli.output import drop_output, drop_unread_output, show
from rcilab.cli.signal_handlers import handled_signals
from rcilab.core.errors import (
    ControlError,
    InvalidValueError,
    ManualRecoveryError,
    RcilabError,
    RecordedError,
    UsageError,
)
from rcilab.core.fault import name_faults

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.conformance.certificate import Certificate
    from rcilab.conformance.report import Report
    from rcilab.core.arrays import JointVector
    from rcilab.core.safety_box import SafetyBox
    from rcilab.core.state import RobotState
    from rcilab.execution.session import RobotSession
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion
    from rcilab.recording.run import Run

_DONE, _NOT_DONE = 0, 1
_TO_START_SPEED = 0.2  # Fraction of the limits; slow, because this path is not part of the program.
_TO_START = "rcilab run --to-start moves the arm to the start of the file, after a confirmation"
_CLEAR = "rcilab run --to-start clears the fault and moves the arm to the start of the file, after a confirmation"
_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # Ctrl-C, kill, a closed terminal.


def add_parser(subparsers: Any) -> None:
    """Adds the command to the `rcilab` parser."""
    parser: ArgumentParser = subparsers.add_parser(
        "run",
        help="run a saved motion or program on a robot",
        description="Checks a motion (.npz from Motion.save, .csv with times and joint angles) or the motion of a "
        "program (.json from Program.save), shows the report, asks for confirmation and runs it. Exit code: 0 it ran "
        "to its end; 1 it does not conform, was not confirmed, or was stopped; 2 bad input, no robot or a fault.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=HELP)
    parser.add_argument(
        "--robot", required=True, metavar="ADDRESS", help="rci://HOST:PORT, fci://HOST, xarm://HOST, realman://HOST"
    )
    parser.add_argument(
        "--model", metavar="NAME", help="arm, such as xMatePro7, or its file my_arm.json; default: that of the robot"
    )
    parser.add_argument(
        "--to-start",
        action="store_true",
        help="first clear a fault and move the arm to the start of the motion, with its own report and confirmation",
    )
    parser.add_argument(
        "--apply",
        action="store_true",
        help="first send tool, load and safety box of the program, or tool and load of the cell, to the controller; "
        "without it, reports what differs",
    )
    add_cell_option(
        parser,
        "checks distances from its obstacles, with its tool and load; --apply sends these; has frames of waypoints",
    )
    parser.add_argument("--yes", action="store_true", help="do not ask; for scripts that have asked before")
    parser.add_argument(
        "--json",
        action="store_true",
        help="print one JSON object, also about an error; SI units; reports and questions go to stderr",
    )
    parser.add_argument(
        "--save",
        type=Path,
        metavar="OUT",
        help="write the recorded run, also of a motion that a fault ends: .rcirun for rcilab replay, .csv, .npz, "
        ".parquet, .mcap or .html; with --to-start the last motion",
    )
    add_max_rows(parser)
    parser.add_argument(
        "--timeout", type=float, default=3.0, metavar="S", help="timeout of every reply of the robot [s]"
    )
    parser.set_defaults(run=run)


def run(args: Namespace) -> int:
    """Runs the motion and returns the exit code.

    Raises:
        RcilabError: Bad input, no robot, or a fault; the caller prints it and exits with 2.
    """
    moves: list[_Move] = []
    with _stopping_on_signals() as stopper:
        try:
            name = _run(args, stopper, moves)
        except KeyboardInterrupt:
            drop_unread_output()
            print("\nNothing was sent.", file=sys.stderr)
            _show_json(args, args.model, "not_agreed", moves)
            return _NOT_DONE
        except BrokenPipeError:  # Before the motion: the operator cannot have read the report or the question.
            drop_output()
            print("The output is closed, so the report cannot be read: nothing was sent.", file=sys.stderr)
            return _NOT_DONE
        except RcilabError as error:
            _show_json(args, args.model, "failed", moves, error)
            raise
    _show_json(args, name, moves[-1].outcome, moves)
    return _DONE if moves[-1].outcome == "done" else _NOT_DONE


class _Stopper:
    """Signal handler: before the motion it ends the command, during the motion it stops the arm."""

    def __init__(self) -> None:
        self._robot: RobotSession | None = None
        self._is_requested = False

    def execute(self, robot: RobotSession, motion: Motion, certificate: Certificate | None) -> Run:
        """Runs the motion until its end or a signal."""
        self._robot = robot
        return robot.execute(motion, certificate, progress=lambda t, duration: self._stop_again())

    def on_signal(self, number: int, frame: object) -> None:
        """Handles a signal in the main thread."""
        if self._robot is None:
            raise KeyboardInterrupt
        self._is_requested = True
        self._robot.stop()

    def _stop_again(self) -> None:
        """Repeats the stop of a signal that arrived between the start request and the first cycle of the motion."""
        if self._is_requested and self._robot is not None:
            self._robot.stop()


@contextmanager
def _stopping_on_signals() -> Iterator[_Stopper]:
    stopper = _Stopper()
    if threading.current_thread() is not threading.main_thread():  # Only the main thread can handle signals.
        yield stopper
        return
    with handled_signals(dict.fromkeys(_STOP_SIGNALS, stopper.on_signal)):
        yield stopper


def _run(args: Namespace, stopper: _Stopper, moves: list[_Move]) -> str:
    """Appends the motions with their outcomes to `moves` and returns the name of the arm."""
    from rcilab.conformance.check import check
    from rcilab.execution.command_validation import find_start_mismatch
    from rcilab.makers.maker import start_tolerance_of
    from rcilab.model.robot_model import load_model
    from rcilab.motion import Program
    from rcilab.recording.export import require_ending

    if args.save is not None:
        require_ending(args.save.suffix)
        if not args.save.parent.is_dir():  # Before anything moves.
            raise InvalidValueError("--save", str(args.save), "is in a folder that does not exist")
    cell = read_cell(args.cell)
    found = resolved(read_file(args.file, args.max_rows), cell, args.file)
    model = load_model(args.model) if args.model else None
    box = None
    if isinstance(found, Program):
        model, box = found.applied_to(model or load_model(found.model)), found.safety_box
    elif args.apply and cell is None:
        raise UsageError("--apply sends tool, load and safety box of a program, and a motion file has none")
    show_note = partial(print, file=_text_stream(args))
    with _connect(args, model, cell, show_note) as robot:
        if box is not None and args.apply:
            robot.set_safety_box(box)
        motion = as_motion(found, robot.model, args.file, show=show_note, max_rows=args.max_rows, cell=cell)
        state = robot.state
        if motion.n != robot.model.n:
            raise UsageError(
                f"{args.file} has {motion.n} joints and {robot.model.name} has {robot.model.n}: it is for another arm"
            )
        mismatch = find_start_mismatch(motion.q[0], state.q_c, start_tolerance_of(robot.model), _TO_START)
        if not args.to_start:  # Before the report, whose violations would all have this cause.
            _require_ready(mismatch, robot, state)
        if mismatch is None:
            motions = [motion]
        else:
            motions = [*_plan_to_start(motion, robot, state.q_c), motion]
            report = check(motion, robot.model, start=motion.q[0], box=box, cell=cell)
            if not report.ok:  # Known before the arm moves to its start.
                moves.append(_refuse(report, args))
                motions = []
        if motions and args.to_start and state.faults:
            _recover(robot, state, args)
        for planned in motions:
            _move(planned, robot, stopper, args, moves, box if planned is motion else robot.safety_box)
            if moves[-1].outcome != "done":
                break
        return robot.model.name


def _connect(
    args: Namespace, model: RobotModel | None, cell: Cell | None, report: Callable[[str], None]
) -> RobotSession:
    """Returns a session; reports what differs from the model's tool and load."""
    from rcilab.execution.connect import connect

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        robot = connect(args.robot, model, args.timeout, apply=args.apply, cell=cell)
    for warning in found:
        report(f"note: {warning.message}; rcilab run --apply sends tool, load and safety box")
    return robot


def _show_json(
    args: Namespace, model: str | None, outcome: str, moves: Sequence[_Move], error: RcilabError | None = None
) -> None:
    """Prints the result of the command with --json."""
    if not args.json:
        return
    from rcilab.cli.report_json import as_json_text, error_as_json

    found = {"model": model, "outcome": outcome, "moves": [move.as_json() for move in moves]}
    show(as_json_text(found if error is None else {**found, "error": error_as_json(error)}))


def _text_stream(args: Namespace) -> TextIO:
    """Returns the stream for text: with --json, stdout is reserved for the JSON."""
    return sys.stderr if args.json else sys.stdout


def _require_ready(mismatch: str | None, robot: RobotSession, state: RobotState) -> None:
    faults = f"the controller reports {name_faults(state.faults)}" if state.faults else ""
    if mismatch is not None:
        raise UsageError(f"{faults}, and {mismatch}" if faults else mismatch)
    if faults and robot.is_powered():  # Without power, switching it on can clear them.
        raise UsageError(f"{faults}; {_CLEAR}")


def _plan_to_start(motion: Motion, robot: RobotSession, q: JointVector) -> list[Motion]:
    """Plans from `q` to the start of a motion; a first motion returns to the joint ranges if `q` is outside them."""
    from rcilab.motion import plan_joint, plan_recovery

    if len(motion.q[0]) != len(q):
        raise UsageError(f"the motion has {len(motion.q[0])} joints but the arm has {len(q)}: it is for another arm")
    back = plan_recovery(robot.model, q)
    approach = plan_joint(robot.model, back.q[-1], motion.q[0], speed=_TO_START_SPEED, law="torque_rate_limited")
    return [back, approach] if back.duration > 0.0 else [approach]


def _recover(robot: RobotSession, state: RobotState, args: Namespace) -> None:
    names = name_faults(state.faults)
    print(f"The robot is stopped by {names}; clearing it. Nothing moves yet.", file=_text_stream(args))
    try:
        robot.recover()
    except ManualRecoveryError:  # Too far outside; switching the power off clears the fault, too.
        robot.power_off()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Move:
    """One motion of the command and its outcome."""

    outcome: Literal["done", "stopped", "failed", "not_conforming", "not_agreed"]
    report: Report
    run: Run | None = None

    def as_json(self) -> dict[str, Any]:
        """Returns the entry for `rcilab run --json`."""
        from rcilab.cli.report_json import report_as_json, run_as_json

        run = None if self.run is None else run_as_json(self.run)
        return {"outcome": self.outcome, "report": report_as_json(self.report), "run": run}


def _move(
    motion: Motion,
    robot: RobotSession,
    stopper: _Stopper,
    args: Namespace,
    moves: list[_Move],
    box: SafetyBox | None,
) -> None:
    """Checks a motion, shows the report, asks for confirmation, runs the motion, and appends it to `moves`."""
    from rcilab.conformance.check import check
    from rcilab.makers.maker import commanded_start

    out = _text_stream(args)
    start = commanded_start(motion.q[0], robot.state.q_c, robot.model)
    report = check(motion, robot.model, start=start, box=box, cell=robot.cell)
    if not report.ok:
        moves.append(_refuse(report, args))
        return
    print(report, file=out)
    print(_describe_move(motion, robot), file=out, flush=True)
    if not args.yes and not _is_confirmed(out):
        moves.append(_Move(outcome="not_agreed", report=report))
        return
    if not robot.is_powered():
        robot.power_on()
    try:
        result = stopper.execute(robot, motion, report.certificate)
    except RecordedError as error:
        moves.append(_Move(outcome="failed", report=report, run=error.run))
        error.advice = _save_after_error(error.run, args)
        if isinstance(error, ControlError) and error.faults:
            error.advice = f"{_CLEAR}; {error.advice}"
        raise
    if not args.json:
        show(result)
    if result.stopped:
        print(
            f"stopped {result.stopped} at t = {result.duration:.2f} s; the arm is at rest; {_TO_START}",
            file=sys.stderr,
        )
    moves.append(_Move(outcome="stopped" if result.stopped else "done", report=report, run=result))
    if args.save is not None:
        result.save(args.save)
        print(f"written: {args.save}", file=out)


def _save_after_error(run: Run | None, args: Namespace) -> str:
    """Writes the run up to an error, if that is wanted; returns where it is, or how to get it the next time."""
    if run is None:
        return "no cycle was recorded"
    if args.save is None:
        return "with --save FILE.rcirun the recorded run is written, also of a motion that ends like this"
    try:
        run.save(args.save)
    except RcilabError as problem:  # The fault matters more.
        return f"the run was not saved: {problem}"
    return f"the run is in {args.save}"


def _refuse(report: Report, args: Namespace) -> _Move:
    print(report, file=_text_stream(args))
    print("The motion does not conform; nothing was sent.", file=sys.stderr)
    return _Move(outcome="not_conforming", report=report)


def _describe_move(motion: Motion, robot: RobotSession) -> str:
    from rcilab.motion.extent import measure_extent

    extent = measure_extent(motion, robot.model)
    return (
        f"{robot.model.name} at {robot.address} will move for {extent.duration:.2f} s. "
        f"Joints: {extent.describe_joints() or 'none moves'}. "
        f"The tool moves up to {1e3 * extent.tool_distance:.0f} mm from its current position. "
        f"Top speeds: joint {extent.fastest_joint} {math.degrees(extent.joint_speed):.1f}°/s, "
        f"tool {extent.tool_speed:.2f} m/s."
    )


def _is_confirmed(out: TextIO) -> bool:
    question = "Keep clear of the arm and keep the emergency stop within reach. Move it? Type yes: "
    print(question, end="", file=out, flush=True)
    try:
        answer = input().strip()
    except EOFError:
        print("\nNothing was sent.", file=sys.stderr)
        return False
    if answer != "yes":
        print(f"{'' if sys.stdin.isatty() else chr(10)}{answer!r} is not 'yes': nothing was sent.", file=sys.stderr)
    return answer == "yes"
