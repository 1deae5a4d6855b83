"""The running controller of any maker: its clock, at 1 kHz or in lock-step, and its sockets. One thread for all.

Free-running, a state is due every millisecond on a fixed grid; its cycle is computed a little before, so that it leaves
in time. A cycle that this process itself missed is left out and counted: the simulated time slips, and the client does
not lose commands for which it had no state to answer (see `CycleTimer`). A client that went on meanwhile, as the
vendor's does on its old state, has then sent more commands than cycles. Such cycles are made up for, one in each
millisecond and without sending a state, or its commands would be played later and later.

In lock-step a motion's next cycle is due when its command has come, however long that takes. When several commands
wait, as after the vendor client's sleep, their cycles are computed without sending a state, and the state after the
last one is the one to answer.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable

from rcilab.core.clock import CYCLE_TIME, SystemClock
from rcilab.core.errors import UsageError
from rcilab.core.fault import FaultCode, name_faults
from rcilab.realtime.cpu_latency import CpuLatencyLock
from rcilab.realtime.scheduling import enter_realtime, leave_realtime
from rcilab.sim.arrivals import (
    Arrival,
    ClientConnected,
    ClientDisconnected,
    ClientRefused,
    DatagramArrived,
    ExtraSocketsReady,
    FrameArrived,
    StrangerDetected,
)
from rcilab.sim.channels import Peer
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.cycle_timer import CycleTimer
from rcilab.sim.endpoint import Endpoint
from rcilab.sim.environment import Environment, ServerCounters
from rcilab.sim.faulty_network import FaultyNetwork
from rcilab.sim.log_lines import LineHandler, LogLines, SeldomLines
from rcilab.sim.maker_server import MakerServer
from rcilab.sim.simulation_port import SimulationPort

PRIORITY = 80  # Under SCHED_FIFO; above the client's process, whose clock this is.
LEAD_TIME = 0.0005  # [s] Before its state is due a cycle begins: longer than nearly all of them take.
RESEND_TIME = 0.02  # [s] In lock-step a state is sent again after this time until the first command has come.
COMMAND_TIMEOUT = (
    60.0  # [s] In lock-step, for the next command; then its cycle is lost, and each following one at 1 kHz.
)
CORRUPTED_TIMEOUT = 0.05  # [s] The same where the network spoils datagrams on purpose: below any client's own.
SLIP = 20  # [cycles] A motion that took so much longer than it should is worth a line.
GRACE = 2.0  # [s] For the arm to stop when the controller shall end.
_parts_log = logging.getLogger("rcilab.sim")
_STDERR = 2
_LOOK = 0.1  # [s] Between looks at whether the parent process still lives, or a stalled controller shall end.


class ArmServer:
    """A virtual controller on its sockets. `run` in one thread; `request_stop` from anywhere, signal handlers too.

    Attributes:
        controller: The controller without its wire; owned by the thread that runs.
        bad_datagrams: Datagrams of the client's that are not well formed.

    Args:
        server: The maker's part: channels, codec, behaviour.
        config: How it is configured.
        log: Takes one line about everything unusual, and must not wait; None: a thread writes them to stderr.

    Raises:
        UsageError: An address or port cannot be used.
    """

    def __init__(
        self, server: MakerServer, config: ControllerConfig, *, log: Callable[[str], None] | None = None
    ) -> None:
        self.config = config
        self.controller = server.controller
        self.bad_datagrams = 0
        self._server = server
        self._has_timed_out = False
        self._lines: LogLines | None = None
        if log is None:
            self._lines = LogLines(_STDERR)
            log = self._lines.write
        self._log = log
        self._clock = SystemClock()
        self._timer = CycleTimer(self._clock.now())
        self._is_ending = False
        self._next_look = 0.0
        self._cores = CpuLatencyLock()
        self._missed_before = 0
        self._logged_faults: tuple[FaultCode, ...] = ()
        self._rare_lines = SeldomLines(log, self._clock.now)
        client = None if config.client_host is None else (config.client_host, config.client_port)
        self._endpoint = Endpoint(config.host, server.channels, client)
        states_network = config.network if config.states_network is None else config.states_network
        self._network = FaultyNetwork(self._endpoint, self._clock, config.network, states_network, log)
        server.attach(self._network)
        self._stalls = StallSchedule()
        self._environment = Environment(
            self.controller,
            self._network,
            self._stalls,
            self._clock,
            lambda: ServerCounters(self.missed, self.bad_datagrams, self._endpoint.strangers),
        )
        self._simulation_port = self._open_simulation_port()

    @property
    def missed(self) -> int:
        """Cycles that were left out because this process was not there for them, or put off; see `cycle_timer`."""
        return self._timer.missed

    @property
    def url(self) -> str:
        """Where clients connect to."""
        return f"{self._server.scheme}://{self._endpoint.host}:{self._endpoint.port}{self._endpoint.options}"

    @property
    def description(self) -> str:
        """The line that reports that the controller is ready."""
        controller = self.controller
        return f"listening {self.url} model={controller.arm.model.name} plant={controller.arm.plant.kind}"

    @property
    def world_address(self) -> str | None:
        """Where the world port is, as ADDR:PORT; None: there is no such port."""
        return None if self._simulation_port is None else "{}:{}".format(*self._simulation_port.address)

    def run(self, on_ready: Callable[[], None] = lambda: None) -> None:
        """Runs until `request_stop`, then stops the arm and closes every socket.

        Args:
            on_ready: Called once, when the first state is out.
        """
        use_realtime = self.config.realtime and not self.config.lockstep
        if use_realtime:
            warning = enter_realtime(PRIORITY).warning
            if warning is not None:
                self._log(warning)
        parts = LineHandler(self._log)
        _parts_log.addHandler(parts)
        try:
            self._loop(on_ready)
        finally:
            _parts_log.removeHandler(parts)
            self._cores.switch(False)
            if use_realtime:
                leave_realtime()
            self.close()
            if self._lines is not None:
                self._lines.close()

    def request_stop(self) -> None:
        """Asks for the end: one controlled stop if the arm moves, then `run` returns."""
        self._is_ending = True

    def close(self) -> None:
        """Closes the sockets of a server that does not run."""
        self._endpoint.close()
        if self._simulation_port is not None:
            self._simulation_port.close()

    def _open_simulation_port(self) -> SimulationPort | None:
        if self.config.world_port is None:
            return None
        try:
            return SimulationPort(self._endpoint.host, self.config.world_port, self._environment.handle)
        except UsageError:
            self._endpoint.close()
            raise

    def _loop(self, on_ready: Callable[[], None]) -> None:
        self._timer.restart(self._clock.now())
        self._stalls.replace(self.config.stalls, self._timer.deadline)
        last_moment: float | None = None
        notice_left = 0
        is_ready = has_served = False
        while True:
            stall = self._stalls.take(self._clock.now())
            if stall > 0.0:
                self._stall(stall)
            if self._is_ending and last_moment is None:
                last_moment = self._clock.now() + GRACE
                notice_left = self._server.begin_shutdown()
            if last_moment is not None:
                notice_left -= 1
                if (not self.controller.is_moving and notice_left < 0) or self._clock.now() > last_moment:
                    return
            if self.config.lockstep and self.controller.wants_commands:
                self._await_command()
                self._timer.restart(self._clock.now())
            else:
                due = self._timer.next(self._clock.now())
                if not (self._is_idle and has_served):
                    self._await(due - (CYCLE_TIME if self._is_idle else LEAD_TIME))
                if self._timer.puts_off(self.controller.is_starved):
                    continue
            has_served = self._step(self._timer.deadline)
            if not is_ready:
                is_ready = True
                on_ready()

    def _stall(self, duration: float) -> None:
        """Does nothing at all for so long, [s], as a controller whose clock stalls; an end asked for goes before."""
        until = self._clock.now() + duration
        while self._clock.now() < until and not self._is_ending:
            self._clock.sleep_until(min(until, self._clock.now() + _LOOK))

    def _poll(self, timeout: float) -> None:
        """Serves the sockets once; waits up to `timeout`, [s], for something to serve."""
        self._take(self._network.poll(timeout, () if self._simulation_port is None else self._simulation_port.sockets))

    def _await(self, deadline: float) -> None:
        """Serves the sockets until the deadline, and at least once."""
        while True:
            self._poll(deadline - self._clock.now())
            if self._clock.now() >= deadline:
                return

    def _await_command(self) -> None:
        """Serves the sockets until a command is there or lost on its way, or the motion or the waiting time is over.

        One that comes too late for its own cycle is not waited for any more, but shows that the client is back: it may
        then catch up.
        """
        controller = self.controller
        is_first = not controller.arm.playout.is_playing
        late = controller.arm.playout.late
        deadline = self._clock.now() + self._command_timeout
        resend = self._clock.now() + RESEND_TIME
        while True:
            remaining = min(deadline - self._clock.now(), _LOOK)
            remaining = resend - self._clock.now() if is_first else remaining
            self._poll(0.0 if len(controller.arm.playout) else remaining)
            self._check_parent()
            if len(controller.arm.playout) or not controller.wants_commands or self._is_ending:
                self._has_timed_out = False
                return
            if self._network.has_lost:
                return
            if self._has_timed_out and controller.arm.playout.late > late:
                self._has_timed_out = False
                deadline = self._clock.now() + self._command_timeout
            if is_first:  # Not at every datagram of a stranger's: states would fill the client's buffer.
                if self._clock.now() >= resend:
                    self._server.send_states()
                    resend = self._clock.now() + RESEND_TIME
            elif self._clock.now() >= deadline:
                self._has_timed_out = True
                return

    @property
    def _command_timeout(self) -> float:
        """How long lock-step waits for the next command, [s]."""
        if self._has_timed_out:
            return CYCLE_TIME
        if self.config.patience is not None:
            return self.config.patience
        return CORRUPTED_TIMEOUT if any(faults.corrupt for faults in self._network.faults) else COMMAND_TIMEOUT

    @property
    def _is_idle(self) -> bool:
        """Whether a cycle may be computed early and sockets be served until its state is due: one wait, not two.

        A request may then show one state later, which does not matter to an arm at standstill.
        """
        is_quiet = self._server.is_quiet and self._endpoint.has_client
        return is_quiet and not (self.controller.is_moving or self.config.lockstep)

    def _step(self, due: float) -> bool:
        """Advances by a cycle and sends its state when it is due, or at once when that time is over.

        Returns whether the sockets were served until then.
        """
        was_moving = self.controller.is_moving
        is_idle = self._is_idle
        self._catch_up()
        self._advance()
        if is_idle:
            self._await(due)
        else:
            self._clock.sleep_until(due)
        self._server.send_states()
        if self.controller.is_moving is not was_moving and not self.config.lockstep:
            self._log_slip()
        self._server.settle()
        self._check_parent()
        return is_idle

    def _check_parent(self) -> None:
        if self.config.parent_pid is not None and self._clock.now() >= self._next_look:
            self._next_look = self._clock.now() + _LOOK
            if os.getppid() != self.config.parent_pid:
                self.request_stop()

    def _catch_up(self) -> None:
        """Advances by cycles without sending their states, when more commands wait than should."""
        if not self.controller.wants_commands:
            return
        playout = self.controller.arm.playout
        extra = len(playout) - 1 - self.config.prefill_cycles if self.config.lockstep else int(playout.work_off())
        for _ in range(extra):
            if self.controller.wants_commands:
                self._advance(is_seen=False)

    def _log_slip(self) -> None:
        """Says how much longer than it should a motion took, when one has ended."""
        if not self.controller.is_moving and self.missed - self._missed_before >= SLIP:
            slipped = 1e3 * CYCLE_TIME * (self.missed - self._missed_before)
            self._log(f"that motion took {slipped:.0f} ms longer than it should: this machine, or a stall, held us up")
        self._missed_before = self.missed

    def _advance(self, *, is_seen: bool = True) -> None:
        """Advances by one cycle."""
        if self.config.realtime and not self.config.lockstep:
            self._cores.switch(self.controller.is_moving)
        self._server.step(is_seen=is_seen)
        self._environment.step()
        faults = self.controller.faults
        if faults is not self._logged_faults and faults != self._logged_faults:
            self._log_faults(faults)

    def _log_faults(self, faults: tuple[FaultCode, ...]) -> None:
        """Logs why error bits were set: by a condition, at the simulation port, by a request."""
        self._logged_faults = faults
        if faults:
            self._log(f"{name_faults(faults)}: {self.controller.reason}; the arm stops")
            if self.controller.lacks_commands and self.controller.arm.playout.lost:
                self._log(
                    "a client that pauses needs a deeper play-out (--prefill 50), SCHED_FIFO for itself, or --lockstep"
                )

    def _take(self, arrivals: list[Arrival]) -> None:
        for arrival in arrivals:
            match arrival:
                case DatagramArrived(datagram):
                    self.bad_datagrams += not self._server.receive_datagram(datagram)
                case FrameArrived(peer, frame):
                    self._server.receive(peer, frame)
                case ClientConnected(peer):
                    self._warn_of_other_target(peer.address)
                    self._server.connect(peer)
                case ClientDisconnected(peer, reason):
                    self._lose_client(peer, reason)
                case ExtraSocketsReady(sockets):
                    if self._simulation_port is not None:
                        self._simulation_port.serve(sockets)
                case StrangerDetected(address, client):
                    whose = f"the client is at {client}" if client else "no client is connected"
                    line = f"left out a UDP datagram from {address}, and will all others: {whose}"
                    self._rare_lines.write("stranger", line, "were left out")
                case ClientRefused(address, holder):
                    line = f"refused another client from {address}: {holder} is connected"
                    self._rare_lines.write("refused", line, "were refused")

    def _warn_of_other_target(self, address: str) -> None:
        target = self._endpoint.fixed_host
        if target not in (None, address):
            line = (
                f"{address} connected, but states go to {target}, as --client says: it will not see any; start with "
                f"--client {address}, or without"
            )
            self._rare_lines.write("elsewhere", line, "connected")

    def _lose_client(self, peer: Peer, reason: str) -> None:
        if self._server.disconnect(peer):
            self._log(f"the client {reason} in mid-motion: the arm stops")
        elif reason != "closed the connection":
            self._rare_lines.write("left", f"the client {reason}", "clients were lost")
