"""The running controller of any maker: its clock, at 1 kHz or in lock-step, and its sockets, in one thread.

Free-running, a state is due every millisecond on a fixed grid; its cycle is computed slightly earlier, so that the
state is sent in time. Cycles that this process missed are skipped and counted: the simulated time slips, and the client
does not lose commands for which it had no state to answer (see `CycleTimer`). A client that continued meanwhile, as the
vendor's does with its old state, has then sent more commands than cycles. Such cycles are caught up, one in each
millisecond and without sending a state; otherwise the delay of its commands would grow.

A maker whose clients are not expected to keep real time gives its server patience: a cycle of a motion waits that long
for its command before it counts as lost, and the grid moves on with it (soft lock-step). Before the first command,
states follow each other after that time, and none counts as lost.

In lock-step the next cycle of a motion is due when the answer to the newest state arrives, without a time limit of its
own. If several commands are queued, as after the vendor client's sleep, their cycles are computed without sending a
state, and the client answers the state after the last one. A client that answers a state again, as the vendor's does
when the next one is late, does not receive the state of that cycle, as if it had been lost. So no state of a motion is
in the client's buffer at its end: the vendor's client would begin its next motion with it.
"""

from __future__ import annotations

import ipaddress
import logging
import math
import os
from collections.abc import Callable, Collection

from rcilab.core.clock import CYCLE_TIME, SystemClock
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import UsageError
from rcilab.core.fault import FaultCode, name_faults
from rcilab.i18n.translator import Remark
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
    UnknownSenderDetected,
)
from rcilab.sim.channels import Peer, UdpChannel
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.controller_config import CONTROLLER_OPTIONS, ControllerConfig
from rcilab.sim.cycle_capture import CycleCapture
from rcilab.sim.cycle_timer import CycleTimer
from rcilab.sim.endpoint import CLOSED, Endpoint
from rcilab.sim.environment import Environment, ServerCounters
from rcilab.sim.faulty_network import FaultyNetwork
from rcilab.sim.local_delivery import is_local_address, is_received_locally
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.log_lines import ControllerLog, LogHandler, LogLines
from rcilab.sim.maker_server import MakerServer
from rcilab.sim.simulation_port import SimulationPort

PRIORITY = 80  # Under SCHED_FIFO; above the client's process, which it clocks.
_SLOWER_PRIORITY = 58  # If no client answers each cycle: above its own client, below those that must answer each.
LEAD_TIME = 0.0005  # [s] From the start of a cycle until its state is due; longer than almost any cycle takes.
RESEND_TIME = 0.02  # [s] In lock-step a state is repeated until the first command arrives, after this time,
_MAX_RESEND_TIME = 0.1  # [s] and then less often: a vendor's client sleeps for 1 s, and then answers every copy.
START_TIMEOUT = 0.1  # [s] In lock-step, for the first command, if a client may need another state before it.
COMMAND_TIMEOUT = (
    60.0  # [s] In lock-step, for the next command; then its cycle is lost, and each following one at 1 kHz.
)
_NOTICE_TIME = 1.0  # [s] In lock-step; a command that takes longer is logged,
_FIRST_NOTICE_TIME = 3.0  # [s] or this for the first one: a vendor client begins 1 s after StartMove.
_RECORDER_TIME = 0.0005  # [s] In lock-step, for a recorder that is behind; shorter than any client's own timeout.
_RECORDER_TIMEOUT = 5.0  # [s] In lock-step; then its motions have gaps.
CORRUPTED_TIMEOUT = 0.05  # [s] The same with simulated corruption of datagrams: below any client's own timeout.
SLIP = 20  # [cycles] A motion that took this much longer than planned is logged.
_MOST_VIOLATIONS = 3  # That the text of a fault names; the others are in its facts.
_UNATTENDED_CYCLES = 10  # Computed together while no client is connected; a tuning value.
GRACE = 2.0  # [s] For the arm to stop before the controller ends.
_parts_log = logging.getLogger("rcilab.sim")
_STDERR = 2
_CHECK_PERIOD = 0.1  # [s] Between checks for the end of the parent process, or for a requested end during a stall.


class ArmServer:
    """A virtual controller on its sockets. `run` in one thread; `request_stop` from anywhere, signal handlers too.

    Attributes:
        controller: The controller without its wire; owned by the thread that runs.
        bad_datagrams: Number of malformed datagrams of the client.
        ring: Every cycle, with the commands of the client; None unless the configuration asks for it.

    Args:
        server: The maker's part: channels, codec, behaviour.
        config: The configuration.
        options: Those of `CONTROLLER_OPTIONS` that the arm's controller has.
        log: Receives the entries of the log, and must not block; None: a thread writes them to stderr.

    Raises:
        UsageError: An address or port cannot be used.
    """

    def __init__(
        self,
        server: MakerServer,
        config: ControllerConfig,
        *,
        options: Collection[str] = CONTROLLER_OPTIONS,
        log: Callable[[LogEntry], None] | None = None,
    ) -> None:
        self.config = config
        self.controller = server.controller
        self.bad_datagrams = 0
        self._server = server
        self._has_datagrams = any(isinstance(channel, UdpChannel) for channel in server.channels)
        self._has_timed_out = False
        self._arrived = 0  # In lock-step: commands of the motion before the newest state was sent.
        self._lines: LogLines | None = None
        if log is None:
            self._lines = LogLines(_STDERR, config.log_format)
            log = self._lines.write
        self._clock = SystemClock()
        self._log = ControllerLog(log, self._clock.now, lambda: self.controller.cycle_number)
        self._timer = CycleTimer(self._clock.now())
        self._is_ending = self._recorder_is_lost = False
        self._next_check = 0.0
        self._cpu_latency_lock = CpuLatencyLock()
        self._missed_before = 0
        self._was_moving = False
        self._awaited = 0.0  # Time that cycles of this motion waited for commands that did not come, [s].
        self._logged_faults: tuple[FaultCode, ...] = ()
        client = None if config.client_host is None else (config.client_host, config.client_port)
        self._endpoint = Endpoint(config.host, server.channels, client)
        states_network = config.network if config.states_network is None else config.states_network
        self._network = FaultyNetwork(self._endpoint, self._clock, config.network, states_network, self._log_event)
        server.attach(self._network)
        self._stalls = StallSchedule()
        self._environment = Environment(
            self.controller,
            self._network,
            self._stalls,
            self._clock,
            lambda: ServerCounters(self.missed, self.bad_datagrams, self._endpoint.unknown_senders),
            lambda: -1 if self.ring is None else self.ring.descriptor,
            options,
            self._log.write,
        )
        self.ring: CycleRing | None = None
        self._capture: CycleCapture | None = None
        self._simulation_port = self._open_simulation_port()
        if config.is_recorded:
            self._begin_record()

    @property
    def missed(self) -> int:
        """Cycles that were skipped because this process was late, or postponed; see `cycle_timer`."""
        return self._timer.missed

    @property
    def host(self) -> str:
        """IPv4 address that it listens on; a name may have been resolved to it."""
        return self._endpoint.host

    @property
    def url(self) -> str:
        """URL for clients."""
        return f"{self._server.scheme}://{self._endpoint.host}:{self._endpoint.port}{self._endpoint.options}"

    @property
    def description(self) -> str:
        """The line that reports that the controller is ready."""
        controller = self.controller
        return f"listening {self.url} model={controller.arm.model.name} plant={controller.arm.plant.kind}"

    @property
    def world_address(self) -> str | None:
        """Address of the simulation port, ADDR:PORT; None without one."""
        return None if self._simulation_port is None else "{}:{}".format(*self._simulation_port.address)

    def run(self, on_ready: Callable[[], None] = lambda: None) -> None:
        """Runs until `request_stop`, then stops the arm and closes every socket.

        Args:
            on_ready: Called once, after the first state was sent.
        """
        if not ipaddress.ip_address(self.host).is_loopback:
            text = f"warning: {self.host} is reachable from outside this machine, where others can move this arm"
            self._log.write("warning", text, host=self.host)
        if self._endpoint.warning:
            self._log.write("warning", self._endpoint.warning)
        if self.config.cell is not None and self.controller.arm.plant.kind == "ideal":
            self._log.write("warning", "the ideal plant has no contacts: the arm passes through the cell's obstacles")
        if self.config.realtime:
            warning = enter_realtime(PRIORITY if self._server.clocks_clients else _SLOWER_PRIORITY).warning
            if warning is not None and not self.config.lockstep:
                self._log.write("warning", warning)
        parts = LogHandler(self._log)
        _parts_log.addHandler(parts)
        try:
            self._loop(on_ready)
        finally:
            _parts_log.removeHandler(parts)
            self._cpu_latency_lock.switch(False)
            if self.config.realtime:
                leave_realtime()
            self.close()
            if self._lines is not None:
                self._lines.close()

    def request_stop(self) -> None:
        """Requests the end: a controlled stop if the arm moves, then `run` returns."""
        self._is_ending = True

    def close(self) -> None:
        """Closes the sockets of a server that is not running."""
        self._endpoint.close()
        if self._simulation_port is not None:
            self._simulation_port.close()
        if self.ring is not None:
            self.ring.close()

    def _begin_record(self) -> None:
        controller, config = self.controller, self.config
        facts = {"model": controller.arm.model.name, "plant": controller.arm.plant.kind, "url": self.url}
        try:
            self.ring = CycleRing.create(controller.arm.model.n, {**facts, "realtime": not config.lockstep})
        except UsageError:
            self.close()
            raise
        settings = {
            "lost_limit": config.lost_limit,
            "realism": config.realism,
            "lockstep": config.lockstep,
        }
        if config.force_sign is not None:
            settings["force_sign"] = config.force_sign
        self._capture = CycleCapture(
            self.ring,
            controller,
            lambda: {
                **settings,
                "prefill": controller.arm.playout.prefill,
                "on_loss": controller.arm.on_loss,
                "limit_table": controller.limit_table,
            },
        )

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
        end_deadline: float | None = None
        notice_left = 0
        is_ready = has_served = False
        while True:
            stall = self._stalls.pop(self._clock.now())
            if stall > 0.0:
                self._stall(stall)
            if self._is_ending and end_deadline is None:
                end_deadline = self._clock.now() + GRACE
                notice_left = self._server.begin_shutdown()
            if end_deadline is not None:
                notice_left -= 1
                if (not self.controller.is_moving and notice_left < 0) or self._clock.now() > end_deadline:
                    return
            if self.config.lockstep and self.controller.wants_commands:
                self._await_recorder()
                self._await_command()
                self._timer.restart(self._clock.now())
                playout = self.controller.arm.playout
                if playout.pop_repeated_answer(self.controller.cycle_number):
                    self._advance_unsent()
                    self._arrived = playout.arrived
                    continue
            elif self.config.lockstep and self.controller.awaits_start:
                self._await_start()
                self._timer.restart(self._clock.now())
            else:
                if self._is_unattended:
                    self._advance_unattended()
                due = self._timer.next(self._clock.now())
                is_idle = self._is_idle
                if not (is_idle and has_served):
                    self._serve_until(due - (CYCLE_TIME if is_idle else LEAD_TIME))
                if self._patience > 0.0:
                    self._await_late_command()
                elif self._timer.postpones(self.controller.is_starved):
                    continue
            has_served = self._step(self._timer.deadline)
            if not is_ready:
                is_ready = True
                on_ready()

    def _stall(self, duration: float) -> None:
        """Does nothing for a duration, [s], like a controller whose clock stalls; a requested end ends the stall."""
        until = self._clock.now() + duration
        while self._clock.now() < until and not self._is_ending:
            self._clock.sleep_until(min(until, self._clock.now() + _CHECK_PERIOD))

    def _poll(self, timeout: float) -> None:
        """Serves the sockets once; waits up to `timeout`, [s], for data."""
        self._handle_arrivals(
            self._network.poll(timeout, () if self._simulation_port is None else self._simulation_port.sockets)
        )

    def _serve_until(self, deadline: float) -> None:
        """Serves the sockets until the deadline, and at least once."""
        while True:
            self._poll(deadline - self._clock.now())
            if self._clock.now() >= deadline:
                return

    def _await_command(self) -> None:
        """Serves the sockets until a command arrives or is lost, the motion ends, or the timeout expires.

        After a timeout, a command that is too late for its cycle shows that the client is active again: it may then
        catch up.
        """
        controller, playout = self.controller, self.controller.arm.playout
        is_first = playout.arrived == 0
        late = playout.late
        deadline = self._clock.now() + self._command_timeout
        resend_time = RESEND_TIME
        resend = self._clock.now() + resend_time
        notice_time = _FIRST_NOTICE_TIME if is_first else _NOTICE_TIME
        notice = self._clock.now() + notice_time
        while True:
            remaining = min(deadline - self._clock.now(), _CHECK_PERIOD)
            remaining = resend - self._clock.now() if is_first else remaining
            self._poll(0.0 if self._is_answered else remaining)
            self._check_periodically()
            if self._is_answered or not controller.wants_commands or self._is_ending:
                self._has_timed_out = False
                return
            if self._network.has_lost:
                return
            if self._clock.now() >= notice:
                notice = math.inf
                self._log_wait(notice_time, playout.late - late)
            if self._has_timed_out and playout.late > late:
                self._has_timed_out = False
                deadline = self._clock.now() + self._command_timeout
            if is_first:  # Not after every unknown datagram: the states would fill the client's buffer.
                if self._clock.now() >= resend:
                    self._server.send_states()
                    resend_time = min(2.0 * resend_time, _MAX_RESEND_TIME)
                    resend = self._clock.now() + resend_time
            elif self._clock.now() >= deadline:
                self._has_timed_out = True
                return

    def _await_start(self) -> None:
        """Serves the sockets until the first command arrives, or the client may wait for another state."""
        deadline = self._clock.now() + START_TIMEOUT
        while self.controller.awaits_start and not self._is_ending:
            remaining = deadline - self._clock.now()
            if remaining <= 0.0:
                return
            self._poll(min(remaining, _CHECK_PERIOD))
            self._check_periodically()

    def _await_late_command(self) -> None:
        """Serves the sockets until the command of this cycle arrives or is lost, or patience ends.

        The cycles after it keep their distance: time that the client takes is not a missed cycle.
        """
        deadline = self._timer.deadline + self._patience
        controller = self.controller
        while (controller.is_starved or controller.awaits_start) and not (self._network.has_lost or self._is_ending):
            remaining = deadline - self._clock.now()
            if remaining <= 0.0:
                self._awaited += self._patience
                break
            self._poll(min(remaining, _CHECK_PERIOD))
            self._check_periodically()
        self._timer.delay(self._clock.now())

    def _log_wait(self, seconds: float, late: int) -> None:
        """Logs what lock-step has waited for since `seconds`; `late` commands came meanwhile."""
        state = self.controller.cycle_number
        text = f"lock-step has waited {seconds:g} s for the command that answers state {state}"
        text += f"; {late} that came meanwhile were too late" if late else "; none came"
        self._log.write("waiting", text, state=state, late=late)

    def _await_recorder(self) -> None:
        """Waits, in lock-step, until the recorder has read the oldest rows; not for one that was stopped or killed.

        Before, each cycle gives it time: a client would answer a state again and again during a long wait.
        """
        if self._capture is None or self._recorder_is_lost:
            return
        if self._capture.is_crowded:
            self._clock.sleep_until(self._clock.now() + _RECORDER_TIME)
        deadline = self._clock.now() + _RECORDER_TIMEOUT
        while not self._capture.has_room and not self._is_ending:
            if self._clock.now() > deadline:
                self._recorder_is_lost = True
                return
            self._clock.sleep_until(self._clock.now() + CYCLE_TIME)

    @property
    def _patience(self) -> float:
        """Timeout for a command outside of lock-step, [s]; 0: a cycle does not wait for it."""
        return self._server.patience if self.config.patience is None else self.config.patience

    @property
    def _command_timeout(self) -> float:
        """Timeout for the next command in lock-step, [s]."""
        return CYCLE_TIME if self._has_timed_out else self._lockstep_patience

    @property
    def _lockstep_patience(self) -> float:
        """Timeout for a command in lock-step while the client is active, [s]."""
        if self.config.patience is not None:
            return self.config.patience
        return CORRUPTED_TIMEOUT if any(faults.corrupt for faults in self._network.faults) else COMMAND_TIMEOUT

    @property
    def _is_idle(self) -> bool:
        """Whether a cycle may be computed early, so that the sockets are served in one wait until its state is due.

        A request may then take effect one state later, which is irrelevant for a stationary arm.
        """
        return self._server.is_quiet and not (self.controller.is_moving or self.config.lockstep)

    @property
    def _is_unattended(self) -> bool:
        """Whether no client is connected or receives states, and nothing moves."""
        return self._is_idle and not (self._endpoint.peers or self._endpoint.fixed_target or self._is_ending)

    def _advance_unattended(self) -> None:
        """Waits for several cycles or until something arrives, then computes the cycles that have become due.

        Waking up costs several times the processor time of such a cycle.
        """
        self._poll(self._timer.deadline + _UNATTENDED_CYCLES * CYCLE_TIME - self._clock.now())
        due = int((self._clock.now() - self._timer.deadline) / CYCLE_TIME)
        for _ in range(min(due, _UNATTENDED_CYCLES)):
            self._timer.next(self._timer.deadline)
            self._advance_unsent()

    def _step(self, due: float) -> bool:
        """Advances by a cycle and sends its state when it is due, or at once if it is overdue.

        Returns whether the sockets were served meanwhile.
        """
        is_idle = self._is_idle
        self._catch_up()
        self._advance()
        if is_idle or not self._has_datagrams:  # Without datagrams, no client answers states: requests need not wait.
            self._serve_until(due)
        else:
            self._clock.sleep_until(due)
        self._server.send_states()
        self._arrived = self.controller.arm.playout.arrived
        if self._capture is not None:
            self._capture.write()
        if self.controller.is_moving is not self._was_moving:
            self._was_moving = not self._was_moving
            if not self.config.lockstep:
                self._log_slip()
        self._server.settle()
        self._check_periodically()
        return is_idle

    def _check_periodically(self) -> None:
        if self._clock.now() >= self._next_check:
            self._next_check = self._clock.now() + _CHECK_PERIOD
            self._log.write_counts()
            if self.config.parent_pid is not None and os.getppid() != self.config.parent_pid:
                self.request_stop()

    def _catch_up(self) -> None:
        """Advances by cycles without sending their states if the client is ahead of the arm.

        It is if more commands are queued than the prefill. Where cycles wait for commands it also is if it skipped
        states that were sent before its first command arrived; it would otherwise stay ahead, and not be waited for.
        """
        if not self.controller.wants_commands:
            return
        arm = self.controller.arm
        playout = arm.playout
        if not (self.config.lockstep or self._patience > 0.0):
            if playout.pop_extra_cycle():
                self._advance_unsent()
            return
        while self.controller.wants_commands and (playout.backlog > 0 or (playout.delay == 0 and arm.is_behind)):
            self._advance_unsent()

    @property
    def _is_answered(self) -> bool:
        """Whether the newest state of a motion in lock-step is answered; after a lost command the stock is smaller."""
        playout = self.controller.arm.playout
        return playout.arrived > self._arrived or playout.is_supplied

    def _advance_unsent(self) -> None:
        """Advances by a cycle whose state is not sent."""
        self._advance(is_sent=False)
        if self._capture is not None:
            self._capture.write()

    def _log_event(self, kind: str, text: str, **facts: object) -> None:
        """Logs an event of the maker's controller, after the fault that caused it."""
        self._log_new_faults()
        self._log.write(kind, text, **facts)

    def _log_slip(self) -> None:
        """Logs by how much a motion took longer than planned, after its end."""
        missed, awaited = CYCLE_TIME * (self.missed - self._missed_before), self._awaited
        self._missed_before, self._awaited = self.missed, 0.0
        if self._was_moving:
            return
        for slipped, why in (
            (missed, "the machine was busy or a stall was simulated"),
            (awaited, "cycles waited for commands that did not come"),
        ):
            if slipped >= SLIP * CYCLE_TIME:
                text = f"that motion took {1e3 * slipped:.0f} ms longer than planned: {why}"
                self._log.write("slip", text, milliseconds=round(1e3 * slipped))

    def _advance(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle."""
        if self.config.realtime and not self.config.lockstep:
            self._cpu_latency_lock.switch(self.controller.is_moving)
        self._server.step(is_sent=is_sent)
        self._environment.step()
        self._log_new_faults()
        if self.controller.arm.warnings:
            self._log_warnings(self.controller.arm.warnings)

    def _log_warnings(self, warnings: list[str]) -> None:
        for text in warnings:
            self._log.write("warning", text)
        warnings.clear()

    def _log_new_faults(self) -> None:
        """Logs the reason for new error bits."""
        faults = self.controller.faults
        if faults is self._logged_faults or faults == self._logged_faults:
            return
        self._logged_faults = faults
        if faults:
            controller, names = self.controller, [fault.manual_name for fault in faults]
            text = f"{name_faults(faults)}: {_shortened(controller.reason)}; the arm stops"
            self._log.write("fault", text, faults=names, reason=str(controller.reason), phase=controller.phase_name)
            if controller.lacks_commands and controller.arm.playout.lost:
                self._log.write("advice", self._advise_on_pauses())

    def _advise_on_pauses(self) -> str:
        if self.config.lockstep:
            return (
                f"lock-step waits {self._lockstep_patience:g} s for a command; a longer --patience is for a client "
                "that pauses for longer, as in a debugger"
            )
        if self._server.patience > 0.0:  # A delay would make its clients unstable.
            return (
                f"a cycle waits {self._patience:g} s for its command, --patience S for longer; --lockstep waits for as "
                "long as the client takes"
            )
        return (
            "--prefill N absorbs pauses of the client of N ms, 100 at most; a client that pauses for longer needs "
            "SCHED_FIFO, or --lockstep"
        )

    def _handle_arrivals(self, arrivals: list[Arrival]) -> None:
        for arrival in arrivals:
            match arrival:
                case DatagramArrived(datagram):
                    self.bad_datagrams += not self._server.receive_datagram(datagram)
                case FrameArrived(peer, frame):
                    if not self._network.has_dropped(peer):
                        self._server.receive(peer, frame)
                case ClientConnected(peer):
                    self._server.connect(peer)  # First: it sends a state, for which the client may wait only briefly.
                    self._log.write("connected", f"{self._name(peer)} connected", client=peer.address)
                    self._warn_of_other_target(peer.address)
                    if self._capture is not None:
                        self._capture.connect(peer.address)
                case ClientDisconnected(peer, reason):
                    self._handle_disconnect(peer, reason)
                case ExtraSocketsReady(sockets):
                    if self._simulation_port is not None:
                        self._simulation_port.serve(sockets)
                case UnknownSenderDetected(address, client):
                    whose = f"the client is at {client}" if client else "no client is connected"
                    text = f"ignored a UDP datagram from {address} and will ignore further ones: {whose}"
                    self._log.write("unknown_sender", text, sender=address, client=client)
                case ClientRefused(address, holders):
                    others = f"{holders[0]} is" if len(holders) == 1 else f"{len(holders)} clients, the most, are"
                    text = f"refused another client from {address}: {others} connected"
                    self._log.write("client_refused", text, client=address, connected=", ".join(holders))

    def _warn_of_other_target(self, address: str) -> None:
        """Warns of a client that does not receive the states, because another address was given for them.

        Two addresses of this machine are those of one client if a socket there receives the states.
        """
        target = self._endpoint.fixed_target
        if target is None or target[0] == address:
            return
        advice = f"start with --client {address}, or without"
        if is_local_address(address) and is_local_address(target[0]):
            if is_received_locally(*target):
                return
            consequence = f"no program receives them there; {advice}"
        else:
            consequence = f"unless that is another address of its machine, it receives none; {advice}"
        text = "{} connected, but states go to {}:{}, because of --client: ".format(address, *target) + consequence
        self._log.write("states_elsewhere", text, client=address, target="{}:{}".format(*target))

    def _name(self, peer: Peer) -> str:
        """Returns a client as the log names it: one of another channel than the main one with its protocol."""
        is_main = peer.channel is self._server.channels[0]
        return f"client {peer.address}" + ("" if is_main else f" ({peer.channel.protocol})")

    def _handle_disconnect(self, peer: Peer, reason: str) -> None:
        phase = self.controller.phase_name
        if self._server.disconnect(peer):
            if self._capture is not None:
                self._capture.disconnect(reason)
            text, kind = f"{self._name(peer)} {reason} during a motion: the arm stops", "client_lost"
        elif reason == CLOSED:
            text, kind = f"{self._name(peer)} disconnected", "disconnected"
        else:
            text, kind = f"{self._name(peer)} {reason}", "client_dropped"
        self._log.write(kind, text, client=peer.address, reason=reason, phase=phase)


def _shortened(reason: Remark) -> str:
    """Returns the first violations of a cycle and the number of the others: a jump violates limits of every joint."""
    parts = reason.parts
    shown = "; ".join(parts[:_MOST_VIOLATIONS])
    more = len(parts) - _MOST_VIOLATIONS
    return shown if more <= 0 else f"{shown}; and {more} more violation{'s' if more > 1 else ''}"
