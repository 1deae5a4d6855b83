"""The motion that a client commands: one command played a cycle, from its modes in the state to the last one queued."""

from __future__ import annotations

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.controller.actuator import ControlLaw
from rcilab.makers.rokae.controller.arm import Arm
from rcilab.makers.rokae.controller.jitter_buffer import FIRST_COMMAND_TIMEOUT, JitterBuffer
from rcilab.makers.rokae.controller.modes import Mode, build_generator
from rcilab.makers.rokae.controller.modes.generator import GeneratorOutput, MotionGenerator
from rcilab.makers.rokae.controller.modes.motion_limits import build_terms
from rcilab.makers.rokae.controller.modes.start import start_tolerance
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.limit_tables import LimitTable

PREFILL = 10  # [cycles] Pauses of client and network that a motion survives unharmed, and its delay. Both ends on one
# busy machine, even under SCHED_FIFO, were measured to pause for 5 to 10 ms now and then.
TORQUE_PREFILL = 2  # [cycles] The same for torques, where the client closes the loop and delay makes it ring; a choice.
LOST_LIMIT = 20  # [cycles] Lost commands in a row that are an instability (manual 4.6: usually 10 to 20).
DRAIN_LIMIT = 300  # [cycles] How long queued commands are played after StopMove; longer than any queue.


class ClientMotion:
    """What a client commands, and how the arm follows it. Owned by the controller's cycle.

    Attributes:
        playout: The queue of commands, with its counts.
        is_followed: Whether commands are played: from `begin` to `discard`, or until `drain` has played what is queued.
        tau: Commanded torques, n plain floats, [N m]; None while none are commanded.

    Args:
        arm: What follows.
        prefill: Cycles between the first command and its play-out.
        torque_prefill: The same for torques; what is older is skipped. None: `prefill`, `TORQUE_PREFILL` at most.
        lost_limit: Lost cycles in a row that raise INSTABILITY_DETECTION; None never does.
    """

    def __init__(self, arm: Arm, prefill: int, torque_prefill: int | None, lost_limit: int | None) -> None:
        self.playout = JitterBuffer(prefill)
        self.is_followed = False
        self.tau: list[float] | None = None
        self._arm = arm
        self._torque_prefill = min(prefill, TORQUE_PREFILL) if torque_prefill is None else torque_prefill
        self._lost_limit = lost_limit
        self._mode = Mode(ControlLaw.POSITION, False)
        self._generator: MotionGenerator | None = None
        self._drain: int | None = None  # Cycles that are left for what is queued; None until the motion is ended.

    @property
    def law(self) -> ControlLaw:
        """How the arm follows."""
        is_over = self._mode.law.leads and self.playout.is_finished  # Nobody holds the arm any more.
        return ControlLaw.POSITION if is_over else self._mode.law

    def prepare(self, mode: Mode) -> None:
        """Forgets the last motion, ready for one in this mode."""
        self._mode = mode
        self.playout.begin(most=self._torque_prefill if mode.law is ControlLaw.TORQUE else None)

    def begin(self, settings: Settings, table: LimitTable) -> None:
        """Follows commands from now on, from where the arm rests.

        Args:
            settings: What the client has set.
            table: Whose bounds of the tool's motion count.
        """
        arm, mode = self._arm, self._mode
        watch = arm.watch
        tolerance = start_tolerance(mode.law, settings)
        if arm.yielded_as is not None:
            tolerance = tolerance.widened(start_tolerance(arm.yielded_as, settings))
        stands = (watch.measured.q, np.array(arm.commanded.q))
        tools = (watch.tool.pose, arm.tool_c.pose)
        terms = build_terms(mode, arm.model, settings, table, stands, tools, tolerance)
        self._generator = build_generator(mode, terms, list(arm.commanded.q))
        watch.begin(
            terms.limits,
            terms.entry_box(),
            settings.collision_thresholds,
            judges_tool=mode.is_cartesian,
            yields=mode.law.yields,
        )
        self.tau = [0.0] * arm.model.n if mode.law is ControlLaw.TORQUE else None
        self.is_followed, self._drain = True, None

    def drain(self) -> None:
        """Plays what is queued, and no more."""
        self._drain = DRAIN_LIMIT

    def discard(self) -> None:
        """Forgets what is queued; nothing is followed any more."""
        self.is_followed = False
        self.playout.clear()

    def follow(self) -> GeneratorOutput | None:
        """Plays what is due in this cycle; None: nothing is. A step that raises faults is not followed."""
        playout = self.playout
        if self._drain is not None:
            self._drain = self._drain - 1 if len(playout) else 0
            if self._drain == 0:
                self.is_followed = False
                return None
        generator = self._generator
        assert generator is not None  # `begin` has made it.
        playback = playout.take(generator.is_next)
        if playback.packet is None and not playback.is_lost:
            return None
        step = generator.step(playback)
        if playback.is_lost and self._lost_limit is not None and playout.lost_in_row >= self._lost_limit:
            lost = playout.lost_in_row
            reason = Remark(f"{lost} commands in a row were lost", "lost_in_row", count=lost)
            if not playout.is_playing:
                seconds = f"{FIRST_COMMAND_TIMEOUT * CYCLE_TIME:g}"
                reason = Remark(f"no command came within {seconds} s of the start", "no_command", seconds=seconds)
            return GeneratorOutput(faults=(Fault.INSTABILITY_DETECTION,), reason=reason)
        if not step.faults:
            self.tau = step.tau
            if step.q is not None:
                self._arm.commanded.move(step.q, step.differences)
        return step
