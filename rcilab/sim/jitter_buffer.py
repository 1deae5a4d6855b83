"""The jitter buffer: commands arrive at irregular times, and one is played per controller cycle.

    waiting --first command, then `prefill` cycles--> playing --empty queue--> losing cycles --next command--> playing

* The first command starts a countdown of `prefill` cycles; as many commands are then queued and absorb the jitter of
  client and network. A burst (the vendor's client may answer 90 old states at once after StartMove) fills the
  queue; its old message ids do not matter.
* While ids advance one by one, they are cycle numbers. An empty queue is a lost cycle, and the command for it, if it
  arrives later, is dropped: the arm has already passed that position.
* Without a first command within `FIRST_COMMAND_TIMEOUT`, the cycles from then on are lost.
* A repeated id is the next command: the vendor's client answers the last state again if none arrived in time. An
  identical datagram is a duplicate and dropped; it only shows that the client is still active.
* A short gap in the ids is either a lost command, or a lost state; only the values of the command can tell. Therefore
  the caller decides whether it continues the motion by one step or by the whole gap. A repeated id right before the
  gap indicates a lost state.
* A command that arrives out of order fills the gap. If states are reordered, the ids of their answers are out of
  order: then the command after the gap continues the motion, and those with the ids of the gap follow it, in the
  order of their arrival; not one that arrived more than `SLACK` commands later, as in a burst.
* If many more commands than the prefill are queued for a long time, the client has sent more commands than there were
  cycles; the loop then runs some extra cycles, because the delay would otherwise grow without bound.
* Commands that close a control loop (torques) must be recent: queued ones beyond the prefill are skipped, oldest first.
  In lock-step none is skipped.
* In lock-step the loop waits for the answer to the newest state (`is_supplied`), so that the delay is one of commands
  and the client never has a state in stock. It runs a cycle of its own for a command that answers an earlier state
  again (`pop_repeated_answer`).
* Commands that come now and then (goals of a planned motion) are played when they arrive; no cycle is lost.
* A long gap, or ids that start again far behind, mean that the client has restarted its numbering: the command is
  treated as the next one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from itertools import islice
from typing import NamedTuple

from rcilab.sim.arm_command import ArmCommand

CAPACITY = 256  # Commands in the queue; then the oldest is dropped. 2.5 of the vendor client's worst bursts (about 92).
WINDOW = 1000  # Cycles that the success rate covers, 1 s.
QUEUE_WINDOW = 100  # Cycles over which the lowest backlog is measured; longer than any jitter.
SLACK = 5  # Cycles of additional delay that are tolerated: a client may be late with its first answer.
FIRST_COMMAND_TIMEOUT = 5000  # Cycles. A vendor client begins 1 s after StartMove; a first callback loads libraries.
LONGEST_GAP = 20  # Ids. The largest loss that the controller bridges (manual 4.6: 10 to 20).


class Playback(NamedTuple):
    """The output of the buffer for one cycle."""

    command: ArmCommand | None
    """The command to play; with `steps` > 1 the next known one, that many cycles ahead; None: no command."""
    steps: int
    """Cycles until `command` is due, 1 for now."""
    is_lost: bool
    """Whether a motion is in progress and this cycle has no command."""
    skipped: int = 0
    """Commands before this one that were skipped for being too old."""


_WAITING = Playback(None, 1, False)
_EMPTY = Playback(None, 1, True)


class JitterBuffer:
    """The queue between network and cycle. Owned by the controller's loop.

    Attributes:
        cycles: Cycles of this motion since its first command was played, the lost ones among them. Those of a motion to
            goals go on until the arm has stopped.
        span: Cycles between its first and its last played command.
        lost: Lost cycles of this motion.
        consecutive_lost: Lost cycles since the last command.
        max_consecutive_lost: Largest number of consecutive lost cycles of this motion.
        late: Commands dropped because their cycle had passed.
        dropped: Commands dropped, oldest first, because the queue was full.
        duplicates: Datagrams dropped as duplicates.
        repeated: Commands that answer a state again, other than the first one: their client received the next one late.
        arrived: Commands that were queued in this motion.
        prefill: Cycles between the first command's arrival and its play-out, from the next motion on.
        delay: The same of this motion.
        window: Cycles that the success rate covers, from the next motion on.

    Args:
        prefill: As the attribute.
        window: As the attribute.
    """

    def __init__(self, prefill: int, window: int = WINDOW) -> None:
        self.prefill = prefill
        self.window = window
        self._queue: deque[ArmCommand] = deque()
        self.begin()

    def begin(self, *, prefill: int | None = None, max_queued: int | None = None, is_streamed: bool = True) -> None:
        """Resets everything for the first command of a motion.

        Args:
            prefill: Cycles between the first command's arrival and its play-out in this motion; None: as usual.
            max_queued: Largest number of queued commands next to the one that is played: it replaces the prefill, and
                older commands are skipped. None: as many as fit.
            is_streamed: Whether every cycle needs a command.
        """
        self._queue.clear()
        self._max_queued = max_queued
        self._is_streamed = is_streamed
        self.delay = self.prefill if prefill is None else prefill
        self._countdown = self.delay if self._max_queued is None else self._max_queued
        self._newest: ArmCommand | None = None
        self._is_repeating = False
        self._lowest, self._observed, self._excess = CAPACITY, 0, 0
        self._outcomes: deque[bool] = deque(maxlen=self.window)
        self._played_in_window = 0
        self._last_id = 0
        self._is_last_lost = False  # The cycle `_last_id` had no command.
        self._surplus = 0  # Commands with a repeated id, right before the next one in the queue.
        self._passed_over: set[int] = set()  # Ids of a gap without lost cycles: their commands may still arrive.
        self._cycles_waited = 0
        self._past: deque[ArmCommand] = deque(maxlen=CAPACITY)  # The last ones that were played or came too late.
        self._lost_since_played = 0
        self.is_playing = False
        self.is_finished = False
        self.cycles = self.span = self.lost = self.consecutive_lost = self.max_consecutive_lost = 0
        self.late = self.dropped = self.duplicates = self.repeated = self.arrived = 0
        self._is_newest_repeated = False
        self._first_id: int | None = None

    def clear(self) -> None:
        """Clears the queue; the counters are kept."""
        self._queue.clear()

    def __len__(self) -> int:
        return len(self._queue)

    @property
    def is_streamed(self) -> bool:
        """Whether every cycle of the motion needs a command."""
        return self._is_streamed

    @property
    def is_starved(self) -> bool:
        """Whether the next cycle is lost unless a command arrives."""
        return self._is_streamed and self.is_playing and not (self.is_finished or self._queue or self._is_repeating)

    @property
    def backlog(self) -> int:
        """Queued commands beyond the prefill, next to that of the coming cycle; 0 where older ones are skipped."""
        return 0 if self._max_queued is not None else max(len(self._queue) - 1 - self.delay, 0)

    @property
    def is_supplied(self) -> bool:
        """Whether as many commands are queued as sent states have been answered, or the last one of the motion is."""
        queue = self._queue
        return len(queue) > self.delay - self._countdown or (len(queue) > 0 and queue[-1].finished)

    def pop_repeated_answer(self, newest: int) -> bool:
        """Returns, once, whether the newest command answers a state again that is older than the `newest` sent one."""
        is_repeated, self._is_newest_repeated = self._is_newest_repeated, False
        return is_repeated and len(self._queue) > 0 and 0 < newest - self._queue[-1].number <= CAPACITY

    @property
    def success_rate(self) -> float:
        """Share of the last cycles that had their command, 0 to 1; 1 before the first one."""
        return self._played_in_window / len(self._outcomes) if self._outcomes else 1.0

    def push(self, command: ArmCommand) -> bool:
        """Queues a command from the network; returns False for a duplicate of one, or after the last one was played."""
        if self.is_finished:  # A client repeats its last command until the state shows the end.
            return False
        queue, newest = self._queue, self._newest
        if command == newest:
            self.duplicates += 1
            self._is_repeating = True
            return False
        # With the newest id it may be the next command, see above, also if it equals an earlier one.
        is_old = newest is not None and command.number not in (newest.number, newest.number + 1)
        if is_old and (command in self._past or command in queue):
            self.duplicates += 1
            return False
        is_repeated = newest is not None and command.number == newest.number
        self._is_newest_repeated = False
        if newest is None or not 0 < newest.number - command.number <= LONGEST_GAP:
            self._newest = command
        if self._is_late(command):
            self.late += 1
            self._past.append(command)
        else:
            if len(queue) >= CAPACITY:
                queue.popleft()
                self.dropped += 1
            queue.append(command)
            self.arrived += 1
            self._is_newest_repeated = is_repeated
            if self._first_id is None:
                self._first_id = command.number
            self.repeated += is_repeated and command.number != self._first_id
        return True

    def pop_extra_cycle(self) -> bool:
        """Returns whether an extra cycle is due: many more commands than the prefill were queued in the last window.

        That is not jitter; the client has sent more commands than there were cycles.
        """
        if self._excess == 0:
            return False
        self._excess -= 1
        return True

    def take(self, is_next: Callable[[ArmCommand, int, bool], bool]) -> Playback:
        """Returns the output for this cycle.

        Args:
            is_next: Returns for a command whose id is a few cycles ahead, `(command, steps, in_doubt)`, whether it
                continues the motion by one step (true) or by that many (false). `in_doubt` is the result if
                neither is clear.
        """
        if self.is_finished or not (self._is_streamed or self._queue):
            self.cycles += self.is_playing and not self._is_streamed
            return _WAITING
        if not self.is_playing:
            if not self._queue:
                self._cycles_waited += 1
                return _WAITING if self._cycles_waited <= FIRST_COMMAND_TIMEOUT else self._lose(_EMPTY)
            if self._countdown > 0:
                self._countdown -= 1
                return _WAITING
            self.is_playing = True
            self._skip_old()
            first = self._queue[0].number
            self._last_id = min(i for i in self._ids() if 0 <= first - i <= LONGEST_GAP) - 1
        self._find_excess()
        skipped = 0 if self._max_queued is None else self._skip_old()
        is_repeating, self._is_repeating = self._is_repeating, False
        if not self._queue:
            return self._bridge_repeat() if is_repeating else self._lose(_EMPTY)
        command, steps = self._find_next(is_next)
        return self._play(command, skipped) if steps == 1 else self._lose(Playback(command, steps, True))

    def is_behind(self, is_next: Callable[[ArmCommand, int, bool], bool]) -> bool:
        """Returns whether the next cycle is lost although the command of a later one is queued; see `take`."""
        return self.is_playing and len(self._queue) > 0 and self._find_next(is_next)[1] > 1

    def _find_next(self, is_next: Callable[[ArmCommand, int, bool], bool]) -> tuple[ArmCommand, int]:
        """Returns the next command of the queue, and the number of cycles until it is due, 1 for now."""
        command = self._queue[0]
        if 1 < command.number - self._last_id <= LONGEST_GAP:
            # States do not overtake so many others: this one was overtaken, in a burst. A slow motion does not show it.
            behind = islice(self._queue, SLACK, None)
            command = next((other for other in behind if other.number == self._last_id + 1), command)
        steps = 1 if command.number == self._last_id + 1 else self._steps_to(command, is_next)
        if steps > 1:  # Unless a reordered command fills the gap, its cycles are lost.
            between = (other for other in self._queue if self._last_id < other.number < command.number)
            command = min(between, key=lambda other: other.number, default=command)
            steps = self._steps_to(command, is_next)
        return command, steps

    def _ids(self) -> Iterator[int]:
        return (command.number for command in self._queue)

    def _steps_to(self, command: ArmCommand, is_next: Callable[[ArmCommand, int, bool], bool]) -> int:
        """Returns the number of cycles until a command is due, 1 for now."""
        ahead = command.number - self._last_id
        if not 1 < ahead <= LONGEST_GAP:
            return 1
        unexplained = max(ahead - self._surplus, 1)
        if unexplained == 1:
            return 1 if is_next(command, ahead, True) else ahead
        return 1 if is_next(command, unexplained, False) else unexplained

    def _is_late(self, command: ArmCommand) -> bool:
        """Returns whether the cycle of a command has already passed."""
        behind = self._last_id - command.number
        if command.number in self._passed_over:
            return False
        return (
            0 <= behind <= max(LONGEST_GAP, self._lost_since_played)
            and (behind > 0 or self._is_last_lost)
            and self.is_playing
        )

    def _find_excess(self) -> None:
        if self.backlog < self._lowest:
            self._lowest = self.backlog
        self._observed += 1
        if self._observed >= QUEUE_WINDOW:
            self._excess = self._lowest if self._lowest > SLACK else 0
            self._observed, self._lowest = 0, CAPACITY

    def _skip_old(self) -> int:
        """Skips commands beyond the largest queue length; returns how many."""
        if self._max_queued is None:
            return 0
        skipped = max(0, len(self._queue) - self._max_queued - 1)
        for _ in range(skipped):
            self._advance_to(self._queue.popleft().number)
        return skipped

    def _bridge_repeat(self) -> Playback:
        """Bridges a cycle without a new command: the client repeated its last one unchanged."""
        self._surplus += 1
        self.consecutive_lost = 0
        self._count(True)
        return _EMPTY

    def _play(self, command: ArmCommand, skipped: int) -> Playback:
        self._queue.remove(command)  # The first one, except for a reordered command.
        self._advance_to(command.number)
        self._past.append(command)
        self.consecutive_lost = self._lost_since_played = 0
        self.is_finished = command.finished
        self._count(True)
        self.span = self.cycles - 1
        return Playback(command, 1, False, skipped)

    def _advance_to(self, played: int) -> None:
        """Stores the id that is played now."""
        last, self._is_last_lost = self._last_id, False
        if played in self._passed_over:
            self._passed_over.remove(played)
            return
        ahead = played - last
        self._surplus = self._surplus + 1 if ahead == 0 else 0
        if self._passed_over:
            self._passed_over = {i for i in self._passed_over if 0 < played - i <= LONGEST_GAP}
        if 1 < ahead <= LONGEST_GAP:
            self._passed_over.update(range(last + 1, played))
        self._last_id = played

    def _lose(self, playback: Playback) -> Playback:
        self._last_id, self._is_last_lost = self._last_id + 1, True
        self.lost += 1
        self.consecutive_lost += 1
        self._lost_since_played += 1
        self.max_consecutive_lost = max(self.max_consecutive_lost, self.consecutive_lost)
        self._count(False)
        return playback

    def _count(self, played: bool) -> None:
        self.cycles += 1
        outcomes = self._outcomes
        if len(outcomes) == outcomes.maxlen:
            self._played_in_window -= outcomes[0]
        outcomes.append(played)
        self._played_in_window += played
