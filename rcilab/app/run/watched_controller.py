"""A virtual controller that a foreign client drives, as a page watches it: everything to read, nothing to send."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rcilab.control_process.status import Lateness, Phase, SupervisorStatus
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import NOT_RECORDED
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import UsageError
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, Mode, RobotMode, require_mode
from rcilab.execution.simulation_control import SimulationControl, parse_simulation_port
from rcilab.makers.configuration import ForceControlFrame, ForceFrame, RobotConfiguration, SoftJointLimits
from rcilab.model.robot_model import RobotModel
from rcilab.recording.client_motions import ClientMotion, ClientMotions, MotionPart
from rcilab.sim.setup_requests import as_setup

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.core.fault import FaultCode
    from rcilab.sim.api import WorldStatus

_DISPLAY_LAG = 5  # [cycles] The command for a row this old has usually arrived; `refresh` adds others.
_SILENCE = 0.5  # [s] Without a new cycle, after which the process is looked for.
_RATE_WINDOW = 1.0  # [s]
_RESPONSES = 4096  # Newest ones of the motion, for the percentiles.
_MEDIAN = 1000  # [cycles] For the median of a time.


class WatchedController:
    """The connection of a page that watches; it reads the controller's record and costs it nothing.

    `status` may be called from any thread; `poll` is called from one.

    Args:
        address: Simulation port of the controller, HOST:PORT, as it prints it.

    Raises:
        InvalidValueError: It is not an address.
        ConnectionLostError: No controller is there.
        UsageError: It keeps no record, or that of another user.
    """

    is_ready = False
    """A page that watches has no robot for requests."""
    stops = 0

    def __init__(self, address: str) -> None:
        host, port = parse_simulation_port(address)
        with SimulationControl(host, port) as world:
            found = world.status()
        if found.record < 0:
            raise UsageError(
                f"the controller at {address} keeps no record to watch: start it with `rcilab controller`, not by "
                "the page or a session"
            )
        self._ring = CycleRing.attach(found.pid, found.record)
        self._pid, self._world_address = found.pid, address
        self._source = Path(f"/proc/{found.pid}/fd/{found.record}")
        self._facts: dict[str, Any] = self._ring.facts
        self._motions = ClientMotions(self._ring, _DISPLAY_LAG)
        self._reader = self._ring.open_reader()
        self.model: RobotModel = self._motions.model
        """The arm, without tool and load."""
        self.name: str = self._facts["url"]
        """Address of the controller."""
        self.setup = RobotConfiguration()
        """The configuration in force; the same object until a part changes. Without a safety box it has none; before
        the first motion it has no force-control frame."""
        self._world: WorldStatus | None = None
        self.follow(found)
        self._lock = threading.Lock()  # Guards what `poll` writes and `status` reads.
        self._mode: Mode = "joint_position"
        self._motion_time: float | None = None
        self._responses: deque[float] = deque(maxlen=_RESPONSES)
        self._ages: deque[int] = deque(maxlen=_MEDIAN)  # [cycles] From a command until it was played.
        self._motion: ClientMotion | None = None  # The present or last one, of which all of these are.
        self._cycles = self._late = self._lost = 0
        self._seen = (0, time.monotonic())  # Rows written, and when that number was new.
        self._rate: deque[tuple[float, int]] = deque()

    def poll(self) -> list[MotionPart]:
        """Returns the new parts of the client's motions."""
        parts = self._motions.poll()
        with self._lock:
            for part in parts:
                self._count(part)
        return parts

    def follow(self, world: WorldStatus) -> None:
        """Takes the configuration in force from a status of the simulation port; one thread calls it."""
        before, self._world = self._world, world
        parts = ("tool", "load", "box", "soft_limits")
        if before is None or any(getattr(before, part) != getattr(world, part) for part in parts):
            self.setup = _configuration(world).updated(self.setup.only(["force"]))

    def refresh(self, cycles: NDArray[np.void], next: int) -> None:
        """Adds the commands to cycles of `poll` that have arrived since, see `ClientMotions.refresh`."""
        self._motions.refresh(cycles, next)

    def status(self) -> SupervisorStatus:
        """Returns what the newest cycle shows."""
        row = self._reader.newest()
        if row is None:
            return SupervisorStatus(phase="connecting", code="connecting", target=self.name, address=self.name)
        state, phase = row[0], self._find_phase(row)
        code = phase if phase == "fault" else f"watched.{phase}"
        with self._lock:
            return SupervisorStatus(
                phase=phase,
                code=code,
                message=f"{self.name} is watched.",
                target=self.name,
                address=self.name,
                world_address=self._world_address,
                q=state["q"].copy(),
                q_c=state["q_c"].copy(),
                dq=state["dq"].copy(),
                tau_ext=state["tau_ext_in_base"].copy(),
                robot_mode=RobotMode(int(state["robot_mode"])),
                controller_mode=ControllerMode(int(state["controller_mode"])),
                faults=self._faults(int(state["faults"])),
                powered=int(state["robot_mode"]) not in (RobotMode.OTHER, RobotMode.USER_STOPPED),
                success_rate=self._success_rate(state, phase),
                rate_hz=self._measure_rate(),
                message_id=int(state["message_id"]),
                late_cycles=self._late,
                lost_cycles=self._lost,
                answer_time=_median(tuple(self._responses)[-_MEDIAN:]),
                round_trip=_median(tuple(CYCLE_TIME * age for age in self._ages)),
                lateness=self._lateness(),
                motion_time=self._motion_time,
                motion_duration=self._motion_time,
                motion_plan_time=self._motion_time,
                mode=self._mode,
                controller_pid=self._pid,
                setup=self.setup,
            )

    def robot(self) -> NoReturn:
        """Raises an error: a page that watches sends nothing.

        Raises:
            UsageError: Always.
        """
        raise UsageError(
            f"this page only watches {self.name}; its own client drives it. Start `rcilab` for an arm of your own"
        ).coded("only_watched", address=self.name)

    def open(
        self,
        model: RobotModel,
        target: str,
        plant: str = "ideal",
        setup: RobotConfiguration | None = None,
        cell: Cell | None = None,
    ) -> None:
        """Raises an error, see `robot`."""
        self.robot()

    def disconnect(self) -> None:
        """Raises an error, see `robot`."""
        self.robot()

    def stop(self) -> None:
        """Does nothing: the motion belongs to the client. The emergency stop of the Run tab stops the arm."""

    def heartbeat(self) -> None:
        """Does nothing: no motion depends on this page."""

    def take_run(self) -> None:
        """Returns None: runs are built from `poll`."""

    def close(self) -> None:
        """Ends watching; the controller does not notice."""
        self._ring.close()

    def _find_phase(self, row: NDArray[np.void]) -> Phase:
        count, since = self._seen
        now = time.monotonic()
        if self._reader.count != count:
            self._seen = self._reader.count, now
        elif now - since > _SILENCE and (self._facts["realtime"] or not self._source.exists()):
            return "lost"
        if int(row["faults"][0]):
            return "fault"
        return "moving" if int(row["motion"][0]) else "idle"

    def _count(self, part: MotionPart) -> None:
        rows = part.cycles
        if part.motion is not self._motion:
            self._motion, self._mode = part.motion, require_mode(part.motion.setup.mode)
            self._take_force_frame(part.motion.setup.settings)
            self._cycles = self._late = self._lost = 0
            self._responses.clear()
            self._ages.clear()
        if len(rows):
            self._motion_time = float(rows["t"][-1])
            times = rows["lateness"]
            self._responses.extend(times[np.isfinite(times)].tolist())
            ages = rows["age"][rows["played"] == 1]
            self._ages.extend(ages[ages != NOT_RECORDED].tolist())
            self._cycles += len(rows)
            self._late, self._lost = int(rows["late"][-1]), self._lost + int(rows["missed"].sum())
        if part.end is not None:
            self._late, self._lost = part.end.late, part.end.lost

    def _take_force_frame(self, settings: Mapping[str, Any]) -> None:
        """Takes the force-control frame from the settings of a motion: only these have it."""
        numbers, axes = settings.get("force_frame"), settings.get("force_axes")
        if numbers is None or axes is None:
            return
        frame = ForceControlFrame(T_flange_force=Pose.from_row_major(numbers), type=ForceFrame[axes.upper()])
        held = self.setup.force
        if (
            held is None
            or held.type != frame.type
            or not np.array_equal(held.T_flange_force.matrix, frame.T_flange_force.matrix)
        ):
            self.setup = self.setup.updated(RobotConfiguration(force=frame))

    def _success_rate(self, state: np.void, phase: Phase) -> float:
        """Returns the controller's share of the last second; after a motion, that of the motion."""
        if phase == "moving" or not self._cycles:
            return float(state["success_rate"])
        return max(1.0 - self._lost / self._cycles, 0.0)

    def _lateness(self) -> Lateness:
        if not self._responses:
            return Lateness()
        times = 1e6 * np.array(self._responses)
        p50, p99, p999 = (float(value) for value in np.percentile(times, (50.0, 99.0, 99.9)))
        edges = np.geomspace(10.0, 1e5, 41)
        histogram = np.histogram(times, edges)[0]
        return Lateness(
            p50=p50, p99=p99, p999=p999, max=float(times.max()), cycles=len(times), edges=edges, histogram=histogram
        )

    def _measure_rate(self) -> float:
        now, count = time.monotonic(), self._reader.count
        self._rate.append((now, count))
        while now - self._rate[0][0] > _RATE_WINDOW and len(self._rate) > 2:
            self._rate.popleft()
        (before, first), (after, last) = self._rate[0], self._rate[-1]
        return (last - first) / (after - before) if after - before > 0.1 else 0.0

    def _faults(self, bits: int) -> tuple[FaultCode, ...]:
        return tuple(fault for fault in self.model.description.faults if bits >> fault & 1) if bits else ()


def _configuration(world: WorldStatus) -> RobotConfiguration:
    """Returns the configuration that a controller reports; None for a part that it does not."""
    limits = world.soft_limits
    return RobotConfiguration(
        tool=None if world.tool is None else as_setup(world.tool).T_flange_tool,
        load=None if world.load is None else as_setup(world.load).load,
        box=None if world.box is None else as_setup(world.box).safety_box,
        joints=None if limits is None else SoftJointLimits(lower=tuple(limits.lower), upper=tuple(limits.upper)),
    )


def _median(times: tuple[float, ...]) -> float | None:
    return float(np.median(times)) if times else None
