"""A recorded run: every cycle as arrays, plan against actual, and the timing of both sides."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.check import check
from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import state_cycles
from rcilab.core.errors import SAFETY_STOP, ControlError, UsageError, plain_text
from rcilab.core.fault import FaultCode, name_faults
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.core.state import MODES, Mode
from rcilab.i18n.notebook_language import language
from rcilab.i18n.translator import Remark
from rcilab.i18n.units import USUAL, Units
from rcilab.motion.motion import Motion
from rcilab.recording.data_frame import to_pandas
from rcilab.recording.export import save_run
from rcilab.recording.playout import played_duration, played_joints, playout_delay
from rcilab.recording.run_file import decode_content, read_run
from rcilab.recording.run_html import run_html
from rcilab.recording.run_setup import Setup
from rcilab.recording.tracking import Tracking, compute_tracking, count_compared, find_stop_time
from rcilab.robots import ROBOTS_BY_MAKER, describe_robot

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.conformance.report import Report
    from rcilab.model.robot_model import RobotModel

_FIRST_ARM = "xMatePro7"  # For a recording without a model and maker: all early recordings are of Rokae arms.
_MAX_DELAY = 64  # [cycles] Between a command and the state that shows it; longer than any play-out buffer.


_SAFETY_STOPS = {
    "estop": "an emergency stop was pressed",
    "gstop": "the safety gate was opened",
    "user_stopped": "the user stop was pressed",
}
"""Values of `Run.stopped` for safety stops, by the code of their status."""


def describe_end(error: BaseException) -> str:
    """Returns `Run.stopped` for a motion that ended with an error; a safety stop is named without its error bits."""
    if isinstance(error, ControlError) and error.code == SAFETY_STOP and error.facts["status"] in _SAFETY_STOPS:
        code = str(error.facts["status"])
        return Remark(_SAFETY_STOPS[code], code)
    return str(error) or type(error).__name__


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Timing of a run. Periods are those of the states' arrival; lateness is relative to the robot's 1 ms grid."""

    cycles: int
    """States answered."""
    lost: int
    """Controller cycles that were not answered: their state did not arrive, or a newer one was there."""
    period_median: float
    """[s]."""
    period_max: float
    """[s]."""
    response_median: float
    """From a state's arrival to its command, [s]."""
    response_max: float
    """[s]."""
    lateness_median: float | None
    """[s]; None if it is not known for any command, such as those that a client counts on its own."""
    lateness_p99: float | None
    """[s]; None as `lateness_median`."""
    lateness_max: float | None
    """[s]; None as `lateness_median`."""
    late: int
    """Cycles answered more than 1 ms late; with a recorded play-out, commands that came after their cycle."""


GOAL_TOLERANCE = 5e-4
"""[rad] A larger distance from the goal is stated with the end of a run. Stiff modes end 20 times closer."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Run:
    """A recorded motion. Arrays have one row per recorded controller cycle and are read-only."""

    plan: Motion | None
    """The planned motion; None for a callback."""
    cycles: NDArray[np.void]
    """Every recorded cycle, see `cycle_dtype`. In a session with `record_all=True` a cycle also has the rest of the
    state, by the names of `RobotState`: `run.cycles["tau_filtered"]`."""
    stopped: str | None = None
    """Why the motion was stopped before its end, a `Remark` where user interfaces have a text; None if it ran to its
    end."""
    truncated: bool = False
    """Whether the beginning is missing because the run was longer than the recorder."""
    realtime: bool = True
    """False in lock-step, where the controller waits for the client and timing has no meaning."""
    model: RobotModel | None = None
    """The arm, with its tool and load; None if it is not known."""
    setup: Setup = field(default_factory=Setup)
    """Circumstances of the run."""
    cell: Cell | None = None
    """The cell that the motion was checked with; None without one."""
    maker: str = ""
    """Maker whose faults the bits of `cycles["faults"]` are; empty: that of the arm."""
    has_speed_override: bool = False
    """Whether the speed override was changed during the motion: then `plan` is the motion as executed."""
    is_complete: bool = True
    """False if it was read from a file whose end is missing or damaged."""
    is_damaged: bool = False
    """Whether the file goes on after the last of these cycles, with damaged content."""

    @property
    def is_safety_stop(self) -> bool:
        """Whether an emergency stop or the safety gate ended it, independent of the error bits."""
        return isinstance(self.stopped, Remark) and self.stopped.code in _SAFETY_STOPS

    @property
    def missing_end(self) -> str:
        """Why `is_complete` is False, as text."""
        return "the rest of its file is damaged" if self.is_damaged else "the end of its file is missing"

    @property
    def t(self) -> Array:
        """Time since the first command, in controller cycles, shape (N,), [s]."""
        return self.cycles["t"]

    @property
    def q(self) -> JointPath:
        """Measured joint angles, shape (N, n), [rad]."""
        return self.cycles["q"]

    @property
    def q_c(self) -> JointPath:
        """Commanded joint angles as the controller reports them, shape (N, n), [rad]."""
        return self.cycles["q_c"]

    @property
    def dq(self) -> JointPath:
        """Measured joint velocities, shape (N, n), [rad/s]."""
        return self.cycles["dq"]

    @property
    def command(self) -> JointPath:
        """Joint angles sent, shape (N, n), [rad]; NaN in cycles in which none were sent."""
        return self.cycles["command"]

    @property
    def tau(self) -> JointPath:
        """Measured joint torques, shape (N, n), [N m]."""
        return self.cycles["tau"]

    @property
    def tau_ext_in_base(self) -> Array:
        """External force and moment in the base frame, shape (N, 6), [N, N m]."""
        return self.cycles["tau_ext_in_base"]

    @property
    def tau_ext_in_stiff(self) -> Array:
        """External force and moment in the force-control frame, shape (N, 6), [N, N m]."""
        return self.cycles["tau_ext_in_stiff"]

    @property
    def T_base_tool(self) -> Array:
        """Measured poses of the tool in base, shape (N, 4, 4), [m]."""
        return self.cycles["T_base_tool"]

    @property
    def theta(self) -> JointPath:
        """Motor positions, motor side of the gear, shape (N, n), [rad]; see `RobotState.theta`."""
        return self.cycles["theta"]

    @property
    def command_pose(self) -> Array:
        """Tool poses sent, shape (N, 4, 4), [m]; NaN in cycles in which none was sent."""
        return self.cycles["command_pose"]

    @property
    def command_psi(self) -> Array:
        """Arm angles sent, shape (N,), [rad]; NaN in cycles in which none was sent."""
        return self.cycles["command_psi"]

    @property
    def command_tau(self) -> JointPath:
        """Joint torques sent, shape (N, n), [N m]; NaN in cycles in which none were sent."""
        return self.cycles["command_tau"]

    @property
    def success_rate(self) -> Array:
        """Share of commands that arrived in time, as the controller reports it, shape (N,)."""
        return self.cycles["success_rate"]

    @property
    def faults(self) -> tuple[FaultCode, ...]:
        """All reported faults, in wire order."""
        bits = int(np.bitwise_or.reduce(self.cycles["faults"])) if len(self.cycles) else 0
        if self.model is not None:
            known = self.model.description.faults
        else:
            known = describe_robot(next(iter(ROBOTS_BY_MAKER.get(self.maker, (_FIRST_ARM,))))).faults
        return tuple(fault for fault in known if bits >> fault & 1)

    @property
    def duration(self) -> float:
        """Time from the first command to the last recorded cycle, [s].

        With a recorded play-out, from the first played command to the last one, or to the cycle without a command for
        which the controller stopped the arm.
        """
        if self.has_playout:
            return played_duration(self.cycles)
        return float(self.t[-1]) if len(self.t) else 0.0

    @property
    def begin(self) -> float:
        """Value of `t` from which `duration` counts, [s]: of the first played command; 0 without a play-out."""
        played = np.flatnonzero(self.cycles["played"]) if self.has_playout else np.zeros(0, np.intp)
        return float(self.t[played[0]]) if played.size else 0.0

    @property
    def has_playout(self) -> bool:
        """Whether a virtual controller recorded which command it played in which cycle: `PLAYOUT_FIELDS`."""
        return "played" in (self.cycles.dtype.names or ())

    @property
    def delay(self) -> int:
        """Cycles between a command and the state that reports it as commanded; found by comparison, usually 1.

        With a recorded play-out it is the usual distance of both.
        """
        if self.has_playout:
            return playout_delay(self.cycles)
        reference = self.command
        if self.plan is not None and not np.isfinite(reference).any():  # Poses were sent: take the planned angles.
            reference = self._planned(0)
            if self.stop_time is not None:
                reference[self.t >= self.stop_time] = np.nan
        faulty = np.flatnonzero(self.cycles["faults"])
        shown = self.q_c if not faulty.size else self.q_c[: faulty[0]]  # After a fault it follows no command.
        return state_cycles(self.cycles) * find_delay(shown, reference[: len(shown)])

    @property
    def stop_time(self) -> float | None:
        """When the arm stopped following its plan, [s]; None: it followed the plan to its end.

        That is when a stop began, or when the controller reported a fault or ended the motion.
        """
        return find_stop_time(self.cycles)

    @property
    def error(self) -> JointPath:
        """Measured minus planned joint angles, shape (N, n), [rad], corrected for the play-out delay.

        NaN from `stop_time` on: an arm that is being stopped does not follow its plan. Without a plan, measured minus
        commanded.
        """
        if self.plan is None:
            return self._lag()
        delay = self.delay
        error = self.q - self._planned(delay)
        error[count_compared(self.cycles, delay) :] = np.nan
        return error

    @property
    def planned(self) -> JointPath:
        """Planned joint angles at each measurement, corrected for the play-out delay, shape (N, n), [rad].

        NaN without a plan.
        """
        return np.full_like(self.q, np.nan) if self.plan is None else self._planned(self.delay)

    @property
    def tracking(self) -> Tracking:
        """`error` per joint and at the tool, over time, as RMS and as maximum."""
        return compute_tracking(self.model, self.q, self.q - self.error)

    @property
    def report(self) -> Report | None:
        """Check of the plan in the mode of the run, of its joint angles if that is unknown; None without plan or arm.

        Computed at each access, with the current conditions.
        """
        if self.plan is None or self.model is None:
            return None
        known: list[Mode] = [mode for mode in MODES if mode == self.setup.mode]
        return check(self.plan, self.model, cell=self.cell, mode=known[0] if known else "joint_position")

    def commanded(self) -> Motion:
        """Returns the motion that the controller reports as commanded, on the 1 ms grid, without the play-out delay.

        Used in place of a plan, for drawing and checking, if a callback moved the arm. Lost cycles are interpolated
        linearly. With a recorded play-out the played commands are taken, then the controller's own stop.

        Raises:
            UsageError: No cycle was recorded.
        """
        if not len(self.t):
            raise UsageError("this run has no cycle: nothing was commanded")
        if self.has_playout:
            return Motion.from_cycles(played_joints(self.cycles))
        times = self.t - self.delay * CYCLE_TIME
        grid = CYCLE_TIME * np.arange(max(round(float(times[-1]) / CYCLE_TIME), 0) + 1)
        return Motion.from_cycles(np.stack([np.interp(grid, times, column) for column in self.q_c.T], axis=1))

    def _planned(self, delay: int) -> JointPath:
        """Returns the plan at every row, delayed by `delay` cycles, shape (N, n), [rad]."""
        assert self.plan is not None
        rows = np.clip(np.rint(self.t / CYCLE_TIME).astype(np.intp) - delay, 0, len(self.plan.q) - 1)
        return self.plan.q[rows]

    def _lag(self) -> JointPath:
        """Returns measured minus commanded joint angles, shape (N, n), [rad], corrected for the play-out delay.

        If no joint angles were sent, those that the controller reports as commanded are used.
        """
        if not np.isfinite(self.command).any():
            return self.q - self.q_c
        delay = self.delay // state_cycles(self.cycles)
        commanded = np.full_like(self.q, np.nan)
        if len(commanded) > delay:
            commanded[delay:] = self.command[:-delay]
            commanded[:delay] = self.command[0]
        return self.q - commanded

    @property
    def largest_error(self) -> float:
        """The largest joint error, [rad]; 0.0 without anything to compare."""
        return float(np.nanmax(np.abs(self.error), initial=0.0))

    @property
    def goal_error(self) -> JointVector | None:
        """Measured joint angles at the end minus the goal, shape (n,), [rad]; None unless it ran to the end of a plan.

        In a compliant mode the arm yields to friction and to errors of the model, and ends next to its goal.
        """
        if self.plan is None or self.stopped or self.faults or not self.is_complete or not len(self.cycles):
            return None
        return self.q[-1] - self.plan.q[-1]

    @property
    def missed_goal(self) -> tuple[int, float] | None:
        """The joint that ended farthest from its goal, from 1, and how far, [rad]; None within `GOAL_TOLERANCE`."""
        error = self.goal_error
        if error is None:
            return None
        joint = int(np.abs(error).argmax())
        return (joint + 1, abs(float(error[joint]))) if abs(error[joint]) > GOAL_TOLERANCE else None

    def _describe_error(self) -> str:
        stop = self.stop_time if self.plan is not None else None
        deviation = f"{self.largest_error:.3g} rad ({math.degrees(self.largest_error):.3g} deg)"
        return deviation if stop is None else f"{deviation} until the stop at {stop:.3f} s"

    @property
    def timing(self) -> Timing:
        """Timing of both sides."""
        sent = self.cycles[self.cycles["sent_ns"] != 0]
        if len(sent) < 2:
            return Timing(
                cycles=len(sent), lost=0, period_median=0.0, period_max=0.0, response_median=0.0, response_max=0.0,
                lateness_median=None, lateness_p99=None, lateness_max=None, late=0,
            )  # fmt: skip
        steps = np.diff(sent["message_id"].astype(np.int64))
        if self.has_playout:  # There a number may have several commands.
            lost = self.cycles["missed"].sum()
        else:
            lost = (steps // state_cycles(self.cycles) - 1).sum()
        period = np.diff(sent["received_ns"]) * 1e-9
        response = (sent["sent_ns"] - sent["received_ns"]) * 1e-9
        lateness = sent["lateness"][np.isfinite(sent["lateness"])]
        late = self.cycles["late"].max() if self.has_playout else (lateness > CYCLE_TIME).sum()
        return Timing(
            cycles=len(sent),
            lost=int(lost),
            period_median=float(np.median(period)),
            period_max=float(period.max()),
            response_median=float(np.median(response)),
            response_max=float(response.max()),
            lateness_median=float(np.median(lateness)) if len(lateness) else None,
            lateness_p99=float(np.quantile(lateness, 0.99)) if len(lateness) else None,
            lateness_max=float(lateness.max()) if len(lateness) else None,
            late=int(late),
        )

    def save(
        self,
        file: str | PathLike[str],
        *,
        progress: Callable[[float], None] | None = None,
        language: str = "en",
        units: Units = USUAL,
    ) -> None:
        """Writes the run to a file; its ending selects the format.

        ==========  ============================================================================================
        .rcirun     everything; load it with `rcilab.load_run`, show it with `rcilab replay FILE`
        .csv        one row per cycle, units in the header; with plan and error next to the measurements
        .npz        one numpy array per field of the recording
        .parquet    the columns of the CSV, for pandas, polars, DuckDB (needs the extra `export`)
        .mcap       messages with JSON schemas, for Foxglove and PlotJuggler (needs the extra `export`)
        .html       one page with 3D scene, timeline and plots that needs neither network nor rcilab
        ==========  ============================================================================================

        Args:
            file: Destination; an existing file is replaced.
            progress: Called with the progress, 0 to 1.
            language: Of the HTML page, "en" or "zh".
            units: Of the HTML page; the other formats are in SI.

        Raises:
            InvalidValueError: The ending is unknown, or the file cannot be written.
            UsageError: The format needs a library that is not installed.
        """
        save_run(self, file, progress=progress, language=language, units=units)

    def to_pandas(self) -> Any:
        """Returns the columns of the CSV as a `pandas.DataFrame`, indexed by t; `.attrs["units"]` has the units.

        Raises:
            UsageError: pandas is not installed.
        """
        return to_pandas(self)

    def __repr__(self) -> str:
        facts = [f"{self.duration:.3f} s", f"{len(self.cycles)} cycles"]
        if len(self.cycles):
            if self.plan is not None or self.setup.mode != "torque":  # Torques by themselves follow nothing.
                facts.append(f"largest error {self._describe_error()}")
            facts.append(f"success rate {float(self.success_rate[-1]):.3f}")
        if self.missed_goal is not None:
            joint, angle = self.missed_goal
            facts.append(f"ended {angle:.2g} rad ({math.degrees(angle):.2g} deg) from its goal at joint {joint}")
        if self.stopped and not self.faults:
            facts.append(f"stopped: {plain_text(self.stopped)}")
        if not self.is_complete:
            facts.append(f"cut off: {self.missing_end}")
        if self.faults:
            facts.append("faults: " + name_faults(self.faults))
        return f"<Run {', '.join(facts)}>"

    def _repr_html_(self) -> str:
        return run_html(self, language())


def find_delay(q_c: JointPath, command: JointPath) -> int:
    """Returns after how many rows the controller reports a command as commanded; found by comparison, usually 1.

    Args:
        q_c: Commanded joint angles as the controller reports them, shape (N, n), [rad].
        command: Joint angles sent, shape (N, n), [rad]; NaN in cycles in which none were sent.
    """
    best, least = 1, math.inf
    for delay in range(1, min(_MAX_DELAY, len(q_c) - 1) + 1):
        difference = np.abs(q_c[delay:] - command[:-delay])
        if np.isfinite(difference).any():
            size = float(np.nanmax(difference))
            if size < least:
                best, least = delay, size
            if size == 0.0:
                break
    return best


def build_run(
    cycles: NDArray[np.void],
    *,
    plan: Motion | None,
    stopped: str | None = None,
    truncated: bool = False,
    realtime: bool = True,
    model: RobotModel | None = None,
    setup: Setup | None = None,
    has_speed_override: bool = False,
    maker: str = "",
    cell: Cell | None = None,
) -> Run:
    """Returns a run from recorded cycles: the rows from the first command on."""
    rows = cycles[np.isfinite(cycles["t"])]
    rows.flags.writeable = False
    return Run(
        plan=plan,
        cycles=rows,
        stopped=stopped,
        truncated=truncated,
        realtime=realtime,
        model=model,
        setup=setup or Setup(),
        has_speed_override=has_speed_override,
        maker=maker,
        cell=cell,
    )


def load_run(file: str | PathLike[str], *, max_rows: int = DEFAULT_MAX_ROWS) -> Run:
    """Returns the run in a `.rcirun` file; of a truncated or damaged one, everything up to its last complete chunk.

    Args:
        file: Path of the file.
        max_rows: Largest allowed number of cycles; the default is 17 minutes.

    Returns:
        The run. `is_complete` is False if the file was truncated, or is damaged after its beginning.

    Raises:
        InvalidValueError: The file does not exist, is not a run, is too long, or is damaged at its beginning.
        VersionMismatchError: It was written by another version of this format.
    """
    return read_run(file, max_rows, Run)


def decode_run(content: bytes, name: str = "stream", *, max_rows: int = DEFAULT_MAX_ROWS) -> Run:
    """Returns the run in the bytes of a `.rcirun` file; see `load_run`."""
    return decode_content(content, name, max_rows, Run)
