"""What became of a motion: every cycle as arrays, plan against actual, and how punctual both sides were."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.check import check
from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import SAFETY_STOP, ControlError, UsageError, plain_text
from rcilab.core.fault import FaultCode, name_faults
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.i18n.notebook_language import language
from rcilab.i18n.units import USUAL, Units
from rcilab.motion.motion import Motion
from rcilab.recording.export import save_run
from rcilab.recording.frame import to_pandas
from rcilab.recording.run_file import decode_content, read_run
from rcilab.recording.run_html import run_html
from rcilab.recording.setup import Setup
from rcilab.recording.tracking import Tracking, compute_tracking, find_stop, last_compared
from rcilab.robots import ROBOTS_BY_MAKER, describe_robot

if TYPE_CHECKING:
    from rcilab.conformance.report import Report
    from rcilab.model.robot_model import RobotModel

_FIRST_ARM = "xMatePro7"  # A recording without a model is of an arm whose controller has the same faults.
_LONGEST_DELAY = 64  # [cycles] between a command and the state that shows it; more is no play-out buffer any more.


_SAFETY_STOPS = {"estop": "an emergency stop was pressed", "gstop": "the safety gate was opened"}
"""What `Run.stopped` says of them, by the code of their status."""


def describe_end(error: BaseException) -> str:
    """Returns what `Run.stopped` says of a motion that ended with an error; a safety stop is named without its bits."""
    if isinstance(error, ControlError) and error.code == SAFETY_STOP:
        return _SAFETY_STOPS.get(str(error.facts["status"]), str(error))
    return str(error) or type(error).__name__


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """How punctual a run was. Periods are those of the states' arrival; lateness is against the robot's 1 ms grid."""

    cycles: int
    """States answered."""
    lost: int
    """Controller cycles that were not answered in their turn: their state never came, or a newer one was there."""
    period_median: float
    """[s]."""
    period_max: float
    """[s]."""
    response_median: float
    """From a state's arrival to the answer, [s]."""
    response_max: float
    """[s]."""
    lateness_median: float
    """[s]."""
    lateness_p99: float
    """[s]."""
    lateness_max: float
    """[s]."""
    late: int
    """Cycles answered more than 1 ms late."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Run:
    """A motion as it happened. Arrays have one row a recorded controller cycle and are read-only."""

    plan: Motion | None
    """What was meant to happen; None for a callback."""
    cycles: NDArray[np.void]
    """Every recorded cycle in full, see `cycle_dtype`. In a session with `record_all=True` a cycle holds the rest of
    the state, too, by the names of `RobotState`: `run.cycles["tau_filtered"]`."""
    stopped: str | None = None
    """Why the motion was stopped before its end; None when it ran to its end."""
    truncated: bool = False
    """Whether the beginning is missing because the run was longer than the recorder."""
    realtime: bool = True
    """False in lock-step, where a millisecond lasts as long as it takes and timing means nothing."""
    model: RobotModel | None = None
    """The arm, with its tool and load; None when it is not known."""
    setup: Setup = field(default_factory=Setup)
    """Where and how it was made."""
    maker: str = ""
    """Name of the maker whose faults the bits of `cycles["faults"]` are; empty: that of the arm."""
    paced: bool = False
    """Whether the speed was changed on the way: then `plan` is what was asked of the arm, at the times it was asked."""
    is_complete: bool = True
    """False when it was read from a file whose end is missing: all that came before is here."""

    @property
    def is_safety_stop(self) -> bool:
        """Whether an emergency stop or the safety gate ended it, whatever error bits that set."""
        return self.stopped in _SAFETY_STOPS.values()

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
        """Joint angles sent in answer, shape (N, n), [rad]; NaN where a cycle was not answered with joint angles."""
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
        """Tool poses sent in answer, shape (N, 4, 4), [m]; NaN where a cycle was not answered with a pose."""
        return self.cycles["command_pose"]

    @property
    def command_psi(self) -> Array:
        """Arm angles sent in answer, shape (N,), [rad]; NaN where none was sent."""
        return self.cycles["command_psi"]

    @property
    def command_tau(self) -> JointPath:
        """Joint torques sent in answer, shape (N, n), [N m]; NaN where a cycle was not answered with torques."""
        return self.cycles["command_tau"]

    @property
    def success_rate(self) -> Array:
        """Share of commands that arrived in time, as the controller reports it, shape (N,)."""
        return self.cycles["success_rate"]

    @property
    def faults(self) -> tuple[FaultCode, ...]:
        """Every fault that was seen, in wire order."""
        bits = int(np.bitwise_or.reduce(self.cycles["faults"])) if len(self.cycles) else 0
        if self.model is not None:
            known = self.model.description.faults
        else:
            known = describe_robot(next(iter(ROBOTS_BY_MAKER.get(self.maker, (_FIRST_ARM,))))).faults
        return tuple(fault for fault in known if bits >> fault & 1)

    @property
    def duration(self) -> float:
        """Time from the first command to the last recorded cycle, [s]."""
        return float(self.t[-1]) if len(self.t) else 0.0

    @property
    def delay(self) -> int:
        """Cycles between a command and the state that reports it as commanded; found by comparison, usually 1."""
        wanted = self.command
        if self.plan is not None and not np.isfinite(wanted).any():  # Sent as poses: the plan says which angles.
            wanted = self._planned(0)
            if self.stop_time is not None:
                wanted[self.t >= self.stop_time] = np.nan
        faulty = np.flatnonzero(self.cycles["faults"])
        shown = self.q_c if not faulty.size else self.q_c[: faulty[0]]  # From there on the controller obeys no command.
        return find_delay(shown, wanted[: len(shown)])

    @property
    def stop_time(self) -> float | None:
        """When the arm stopped following its plan, [s]; None: it followed to its end.

        That is when a stop began, or when the controller showed a fault or ended the motion.
        """
        return find_stop(self.cycles)

    @property
    def error(self) -> JointPath:
        """Measured minus planned joint angles, shape (N, n), [rad], with the play-out delay taken out.

        NaN from `stop_time` on: an arm that is stopped leaves its plan on purpose. Without a plan, measured
        minus commanded.
        """
        if self.plan is None:
            return self._lag()
        delay = self.delay
        error = self.q - self._planned(delay)
        error[last_compared(self.cycles, delay) :] = np.nan
        return error

    @property
    def planned(self) -> JointPath:
        """Planned joint angles that each measurement answers to, the play-out delay taken out, shape (N, n), [rad].

        Without a plan NaN.
        """
        return np.full_like(self.q, np.nan) if self.plan is None else self._planned(self.delay)

    @property
    def tracking(self) -> Tracking:
        """`error` per joint and at the tool, over time, as RMS and as maximum."""
        return compute_tracking(self.model, self.q, self.q - self.error)

    @property
    def report(self) -> Report | None:
        """The verdict on the plan; None without a plan or an arm. Checked again each time, by the table of today."""
        if self.plan is None or self.model is None:
            return None
        return check(self.plan, self.model)

    def commanded(self) -> Motion:
        """Returns the motion that the controller reports as commanded, on its 1 ms grid, the play-out delay taken out.

        It stands in for the plan where a callback moved the arm: to be drawn and checked. Cycles of which no state came
        lie on straight lines.

        Raises:
            UsageError: No cycle was recorded.
        """
        if not len(self.t):
            raise UsageError("this run has no cycle: nothing was commanded")
        times = self.t - self.delay * CYCLE_TIME
        grid = CYCLE_TIME * np.arange(max(round(float(times[-1]) / CYCLE_TIME), 0) + 1)
        return Motion.from_cycles(np.stack([np.interp(grid, times, column) for column in self.q_c.T], axis=1))

    def _planned(self, delay: int) -> JointPath:
        """The plan at every row, `delay` cycles late, shape (N, n), [rad]."""
        assert self.plan is not None
        rows = np.clip(np.rint(self.t / CYCLE_TIME).astype(np.intp) - delay, 0, len(self.plan.q) - 1)
        return self.plan.q[rows]

    def _lag(self) -> JointPath:
        """Measured minus commanded joint angles, shape (N, n), [rad], with the play-out delay taken out.

        Where no joint angles were sent, against those that the controller reports as commanded.
        """
        if not np.isfinite(self.command).any():
            return self.q - self.q_c
        delay = self.delay
        wanted = np.full_like(self.q, np.nan)
        if len(wanted) > delay:
            wanted[delay:] = self.command[:-delay]
            wanted[:delay] = self.command[0]
        return self.q - wanted

    @property
    def largest_error(self) -> float:
        """The largest joint error, [rad]; 0.0 where nothing is compared."""
        return float(np.nanmax(np.abs(self.error), initial=0.0))

    def _told_error(self) -> str:
        """In words, and until when where it was stopped."""
        stop = self.stop_time if self.plan is not None else None
        deviation = f"{self.largest_error:.3g} rad ({math.degrees(self.largest_error):.3g} deg)"
        return deviation if stop is None else f"{deviation} until the stop at {stop:.3f} s"

    @property
    def timing(self) -> Timing:
        """How punctual both sides were."""
        sent = self.cycles[self.cycles["sent_ns"] != 0]
        if len(sent) < 2:
            return Timing(
                cycles=len(sent), lost=0, period_median=0.0, period_max=0.0, response_median=0.0, response_max=0.0,
                lateness_median=0.0, lateness_p99=0.0, lateness_max=0.0, late=0,
            )  # fmt: skip
        steps = np.diff(sent["message_id"].astype(np.int64))
        period = np.diff(sent["received_ns"]) * 1e-9
        response = (sent["sent_ns"] - sent["received_ns"]) * 1e-9
        lateness = sent["lateness"]
        return Timing(
            cycles=len(sent),
            lost=int((steps - 1).sum()),
            period_median=float(np.median(period)),
            period_max=float(period.max()),
            response_median=float(np.median(response)),
            response_max=float(response.max()),
            lateness_median=float(np.median(lateness)),
            lateness_p99=float(np.quantile(lateness, 0.99)),
            lateness_max=float(lateness.max()),
            late=int((lateness > CYCLE_TIME).sum()),
        )

    def save(
        self,
        file: str | PathLike[str],
        *,
        progress: Callable[[float], None] | None = None,
        language: str = "en",
        units: Units = USUAL,
    ) -> None:
        """Writes the run to a file; its ending chooses the format.

        ==========  ============================================================================================
        .rcirun     everything, to be loaded with `rcilab.load_run` or shown with `rcilab replay FILE`
        .csv        a row a cycle, units in the header; with the plan and the error beside the measurements
        .npz        one numpy array a field of the recording
        .parquet    the columns of the CSV, for pandas, polars, DuckDB (needs the extra `export`)
        .mcap       messages with JSON schemas, for Foxglove and PlotJuggler (needs the extra `export`)
        .html       one page with 3D, timeline and plots that needs no network and no rcilab
        ==========  ============================================================================================

        Args:
            file: Its name; an existing file is replaced.
            progress: Called with the share that is done, 0 to 1.
            language: Of the HTML page, "en" or "zh".
            units: Of the HTML page; numbers for programs are SI.

        Raises:
            InvalidValueError: The ending is unknown, or the file cannot be written.
            UsageError: The format needs a library that is not installed, or an arm, which this run does not have.
        """
        save_run(self, file, progress=progress, language=language, units=units)

    def to_pandas(self) -> Any:
        """Returns the columns of the CSV as a `pandas.DataFrame`, indexed by t; units stand in `.attrs["units"]`.

        Raises:
            UsageError: pandas is not installed.
        """
        return to_pandas(self)

    def __repr__(self) -> str:
        facts = [f"{self.duration:.3f} s", f"{len(self.cycles)} cycles"]
        if len(self.cycles):
            facts.append(f"largest error {self._told_error()}")
            facts.append(f"success rate {float(self.success_rate[-1]):.3f}")
        if self.stopped:
            facts.append(f"stopped: {plain_text(self.stopped)}")
        if not self.is_complete:
            facts.append("cut off: the end of its file is missing")
        if self.faults:
            facts.append("faults: " + name_faults(self.faults))
        return f"<Run {', '.join(facts)}>"

    def _repr_html_(self) -> str:
        return run_html(self, language())


def find_delay(q_c: JointPath, command: JointPath) -> int:
    """Returns how many cycles after a command the controller reports it as commanded; found by comparison, usually 1.

    Args:
        q_c: Commanded joint angles as the controller reports them, shape (N, n), [rad].
        command: Joint angles sent in answer, shape (N, n), [rad]; NaN where a cycle was not answered.
    """
    best, least = 1, math.inf
    for delay in range(1, min(_LONGEST_DELAY, len(q_c) - 1) + 1):
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
    paced: bool = False,
    maker: str = "",
) -> Run:
    """Returns the run in a recording: the rows from the first command on."""
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
        paced=paced,
        maker=maker,
    )


def load_run(file: str | PathLike[str], *, max_rows: int = DEFAULT_MAX_ROWS) -> Run:
    """Returns the run in a `.rcirun` file; of one that was cut off, all up to its last whole block.

    Args:
        file: The file's name.
        max_rows: How many cycles it may hold: 17 minutes.

    Returns:
        The run. `is_complete` is False when the file was cut off.

    Raises:
        InvalidValueError: There is no such file, it holds no run or too long a one, or not even its beginning is whole.
        VersionMismatchError: It was written by another version of this format.
    """
    return read_run(file, max_rows, Run)


def decode_run(content: bytes, name: str = "stream", *, max_rows: int = DEFAULT_MAX_ROWS) -> Run:
    """Returns the run in the bytes of a `.rcirun` file; see `load_run`."""
    return decode_content(content, name, max_rows, Run)
