"""A motion that a client streams: one command a cycle, from the jitter buffer through a motion generator."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Remark
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators.generator import GeneratorOutput, MotionGenerator
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.jitter_buffer import FIRST_COMMAND_TIMEOUT, JitterBuffer, Playback
from rcilab.sim.violations import ArmCondition, ArmViolation

PREFILL = 10  # [cycles] Pauses of client and network that are absorbed, and the delay of commands. On one busy
# machine, even under SCHED_FIFO, occasional pauses of 5 to 10 ms were measured at both ends.
TORQUE_PREFILL = 2  # [cycles] The same for torques: the client closes the loop, and delay makes it oscillate.
LOST_LIMIT = 20  # [cycles] Consecutive lost commands that end a motion (RCI manual 4.6: usually 10 to 20).
LATE_TOLERANCE = 30  # [cycles] Where commands are held, one that comes this late is late, not lost: on a real arm they
# stopped coming for 22 cycles in a row, during a pause of some 30 ms, without a fault (docs/pauses.md).
DRAIN_LIMIT = 300  # [cycles] How long queued commands are played after the end of the stream; longer than any queue.

LossBehaviour: TypeAlias = Literal["hold", "bridge"]
"""What the arm does while commands are missing: it holds the last one, or continues the motion."""
LOSS_BEHAVIOURS: tuple[LossBehaviour, ...] = get_args(LossBehaviour)


def require_loss_behaviour(name: str) -> LossBehaviour:
    """Returns a behaviour by its name.

    Raises:
        InvalidValueError: There is no such behaviour.
    """
    for behaviour in LOSS_BEHAVIOURS:
        if behaviour == name:
            return behaviour
    raise InvalidValueError("on_loss", name, f"is unknown; known: {', '.join(LOSS_BEHAVIOURS)}")


class StreamedMotion:
    """The commands of a client, played one per cycle. Owned by the virtual arm.

    Attributes:
        on_loss: What the arm does without commands.
        playout: The queue of commands, with its counts.
        is_followed: Whether commands are played: from `begin` to `discard`, or until `drain` has played the queue.
        playback: The output of the queue in the last `step`; None: it had none.

    Args:
        prefill: Cycles between the first command and its play-out.
        torque_prefill: The same for torques. None: `prefill`, `TORQUE_PREFILL` at most.
        skips_torques: Whether torques that are older are skipped.
        lost_limit: Consecutive lost commands that end the motion with a violation; None: no limit. Where commands are
            held, those that are at most `LATE_TOLERANCE` late do not count.
    """

    def __init__(
        self, prefill: int, torque_prefill: int | None, lost_limit: int | None, *, skips_torques: bool = True
    ) -> None:
        self.playout = JitterBuffer(prefill)
        self.is_followed = False
        self.playback: Playback | None = None
        self.mode = MotionMode(ControlLaw.POSITION, CommandKind.JOINT_ANGLES)
        self._torque_prefill = torque_prefill
        self._skips_torques = skips_torques
        self._lost_limit = lost_limit
        self.on_loss: LossBehaviour = "hold"
        self._generator: MotionGenerator | None = None
        self._drain: int | None = None  # Remaining cycles for the queue; None until the stream has ended.

    @property
    def law(self) -> ControlLaw:
        """The control law that follows the commands."""
        is_over = self.mode.law.is_force_driven and self.playout.is_finished  # No further command holds the arm.
        return ControlLaw.POSITION if is_over else self.mode.law

    @property
    def is_off_commands(self) -> bool:
        """Whether the reference still responds to commands that were missing."""
        return self.is_followed and self._generator is not None and self._generator.is_off_commands

    @property
    def is_behind(self) -> bool:
        """Whether the next cycle is lost although the command of a later one is queued."""
        return self.is_followed and self._generator is not None and self.playout.is_behind(self._generator.is_next)

    def set_prefill(self, cycles: int) -> None:
        """Sets the cycles between the first command and its play-out, of torques too, from the next motion on."""
        self.playout.prefill = self._torque_prefill = cycles

    def prepare(self, mode: MotionMode, on_loss: LossBehaviour) -> None:
        """Resets everything for a motion in this mode.

        Args:
            mode: Type of command and control law.
            on_loss: What the arm does without commands, if they are places; torques are held in any case, and
                velocities bridged.
        """
        self.mode, self.on_loss = mode, on_loss if mode.can_hold else "bridge"
        if not mode.is_streamed:
            self.playout.begin(max_queued=0, is_streamed=False)  # Of goals the newest one counts.
        elif mode.law is not ControlLaw.TORQUE:
            self.playout.begin()
        else:
            usual = min(self.playout.prefill, TORQUE_PREFILL)
            prefill = usual if self._torque_prefill is None else self._torque_prefill
            self.playout.begin(prefill=prefill, max_queued=prefill if self._skips_torques else None)

    def begin(self, generator: MotionGenerator) -> None:
        """Plays commands from now on."""
        self._generator = generator
        self.is_followed, self._drain = True, None

    def drain(self) -> None:
        """Plays the queued commands and ends."""
        self._drain = DRAIN_LIMIT

    def discard(self) -> None:
        """Clears the queue and ends."""
        self.is_followed = False
        self.playout.clear()

    def step(self) -> GeneratorOutput | None:
        """Plays the command that is due in this cycle; None without one. Do not follow an output with violations."""
        playout = self.playout
        self.playback = None
        generator = self._generator
        assert generator is not None  # `begin` has set it.
        if self._drain is not None:
            self._drain -= 1
            settled = None if len(playout) else generator.settle()
            if self._drain <= 0 or not (len(playout) or settled):
                self.is_followed = False
                return None
            if settled is not None:
                return settled
        playback = self.playback = playout.take(generator.is_next)
        if playback.command is None and not playback.is_lost:
            return generator.settle()
        output = generator.step(playback)
        limit = self._longest_loss()
        if playback.is_lost and limit is not None and playout.consecutive_lost >= limit:
            return GeneratorOutput(violations=(ArmViolation(ArmCondition.COMMANDS_ARRIVE, self._describe_loss()),))
        return output

    def _longest_loss(self) -> int | None:
        """Returns the number of consecutive cycles without a command that ends the motion; None: none does."""
        return None if self._lost_limit is None else self._lost_limit + self._tolerance

    @property
    def _tolerance(self) -> int:
        """Cycles by which a command may be late before it is lost."""
        return LATE_TOLERANCE if self.on_loss == "hold" else 0

    def _describe_loss(self) -> Remark:
        if not self.playout.is_playing:
            seconds = f"{FIRST_COMMAND_TIMEOUT * CYCLE_TIME:g}"
            return Remark(f"no command came within {seconds} s of the start", "no_command", seconds=seconds)
        count, late = self.playout.consecutive_lost, self._tolerance
        if not late:
            return Remark(f"{count} cycles in a row had no command", "lost_in_row", count=count)
        text = f"{count} cycles in a row had no command: {late} by which one may be late, then {count - late} lost"
        return Remark(text, "lost_in_row_late", count=count, late=late, lost=count - late)
