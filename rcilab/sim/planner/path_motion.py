"""Motion through a queue of targets along their paths, which may stop and continue at any time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.planner.corner import Corner, CornerPreparation, can_join, has_blend
from rcilab.sim.planner.mover import MotionState
from rcilab.sim.planner.path_time_law import PathTimeLaw, Stretch
from rcilab.sim.planner.planner_event import EventKind, PlannerEvent, Refusal
from rcilab.sim.planner.preparation import PlannedArm, Preparation, PreparedTarget
from rcilab.sim.planner.section import Section
from rcilab.sim.planner.section_bounds import ShareBounds
from rcilab.sim.planner.target import JointTarget, PauseTarget, Target

_AHEAD = 16  # Targets that are known ahead, the running one among them.
_DIFFERENCE = 1e-4  # Step of the share for derivatives by it.


@dataclass(slots=True, eq=False)
class _Piece:
    """A part of a section on the chain of sections without a stop between them."""

    section: Section
    bounds: tuple[ShareBounds, ...]
    begin: float
    """Path length at its begin."""
    share: float
    """Share of the section there."""
    scale: float
    """Path length of the whole section."""
    last_share: float = 1.0
    """Share of the section at its end."""

    @property
    def end(self) -> float:
        return self.begin + self.scale * (self.last_share - self.share)

    def share_at(self, s: float) -> float:
        return min(self.share + (s - self.begin) / self.scale, self.last_share)

    def stretches(self) -> list[Stretch]:
        scale, found = self.scale, list[Stretch]()
        for end, velocity, acceleration, jerk in self.bounds:
            if end > self.share:
                s = self.begin + scale * (min(end, self.last_share) - self.share)
                found.append(Stretch(s, scale * velocity, scale * acceleration, scale * jerk))
                if end >= self.last_share:
                    break
        return found


class PathMotion:
    """Moves through a queue of targets. Owned by a planner.

    Sections that a corner joins are one chain, followed by one time law; otherwise the arm stops between two targets.

    Args:
        arm: The arm.
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, arm: PlannedArm, q: Sequence[float]) -> None:
        self._arm = arm
        self._q = list(q)
        self._time_law = PathTimeLaw()
        self._waiting: deque[Target] = deque()
        self._preparation: Preparation | None = None
        self._ready: deque[PreparedTarget] = deque()
        self._refused: Refusal | None = None  # Of the first waiting target.
        self._chain: deque[PreparedTarget] = deque()  # Of the path, the running one first.
        self._pieces: deque[_Piece] = deque()
        self._marks: deque[tuple[float, PlannerEvent]] = deque()  # Events at path lengths.
        self._corner: CornerPreparation | None = None
        self._is_corner_tried = False
        self._dwell = 0
        self._is_paused = False
        self._is_ending = False

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands: at a target, during a pause, or without one."""
        return self._time_law.is_stationary

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to do."""
        return not (self._chain or self._dwell or self._ready or self._waiting)

    @property
    def is_paused(self) -> bool:
        """Whether it stops, or has stopped, until `resume`."""
        return self._is_paused

    @property
    def queued(self) -> int:
        """Number of targets that have not ended."""
        return len(self._chain) + len(self._ready) + len(self._waiting)

    @property
    def current(self) -> Target | None:
        """The target that has begun and not ended."""
        return self._chain[0].target if self._chain else None

    @property
    def end_q(self) -> list[float] | None:
        """Joint angles at the end of the last target, n plain floats, [rad]; None: they are not computed yet."""
        q = list(self._next_start())
        for target in self._waiting:
            if not isinstance(target, JointTarget) or target.q is None:
                return None
            q = [a + b for a, b in zip(q, target.q, strict=True)] if target.is_relative else list(target.q)
        return q

    @property
    def progress(self) -> float:
        """Share of the path of the current target, 0 to 1; 1 without one."""
        for piece in self._pieces:
            if self._chain and piece.section is self._chain[0].section:
                return piece.share_at(self._time_law.s)
        return 1.0

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        time_law, q = self._time_law, self._q
        if time_law.is_stationary or not self._pieces:
            return MotionState(list(q), [0.0] * len(q), [0.0] * len(q))
        piece = self._pieces[0]
        share = min(max(piece.share_at(time_law.s), _DIFFERENCE), 1.0 - _DIFFERENCE)
        before, here, after = (np.array(piece.section.at(share + side * _DIFFERENCE, q).q) for side in (-1.0, 0.0, 1.0))
        first, second = (after - before) / (2.0 * _DIFFERENCE), (after - 2.0 * here + before) / _DIFFERENCE**2
        rate, change = time_law.ds / piece.scale, time_law.dds / piece.scale
        return MotionState(list(q), (rate * first).tolist(), (rate * rate * second + change * first).tolist())

    def begin_at(self, q: Sequence[float]) -> None:
        """Sets the joint angles of the standing arm, n plain floats, [rad], before its first target begins."""
        self._q = list(q)

    def add(self, target: Target) -> None:
        """Appends a target."""
        self._waiting.append(target)

    def set_override(self, part: float) -> None:
        """Multiplies the velocities of all targets; above 0, up to 1."""
        self._time_law.set_override(part)

    def pause(self) -> None:
        """Stops on the path, inside the bounds of the target."""
        self._is_paused = True
        self._time_law.pause()

    def resume(self) -> None:
        """Continues on the path."""
        self._is_paused = False
        if not self._is_ending:
            self._time_law.resume()

    def end(self) -> None:
        """Stops on the path, then discards all targets."""
        self._is_ending = True
        self._time_law.pause()

    def clear_queue(self) -> tuple[PlannerEvent, ...]:
        """Discards the targets to which the path does not lead yet, and returns their events."""
        dropped = [ready.target.id for ready in self._ready] + [target.id for target in self._waiting]
        self._ready.clear()
        self._waiting.clear()
        self._preparation = self._corner = self._refused = None
        return tuple(PlannerEvent(number, EventKind.DISCARDED) for number in dropped)

    def discard(self) -> tuple[PlannerEvent, ...]:
        """Discards all targets and returns their events; the arm must stand, or something else stop it."""
        dropped = [PlannerEvent(prepared.target.id, EventKind.DISCARDED) for prepared in self._chain]
        self._forget_path()
        self._is_ending = self._is_paused = False
        return (*dropped, *self.clear_queue())

    def skip(self) -> tuple[PlannerEvent, ...]:
        """Discards the current target of the standing arm; those after it begin here. Returns its event."""
        if not self._chain:
            return ()
        first, *others = self._chain
        self._waiting.extendleft(
            [
                *reversed([ready.target for ready in self._ready]),
                *reversed([prepared.target for prepared in others]),
            ]
        )
        self._ready.clear()
        self._forget_path()
        return (PlannerEvent(first.target.id, EventKind.DISCARDED),)

    def step(self) -> tuple[list[float], list[PlannerEvent]]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad], and the events.

        Raises:
            KinematicsError: The path is not reachable after all. The arm has not moved; something else must stop it.
        """
        events: list[PlannerEvent] = []
        self._work()
        if not (self._pieces or self._dwell or self._is_paused or self._is_ending):
            self._begin(events)
        if self._pieces:
            if self._time_law.s > 0.0 or not (self._corner or self._can_join()):  # It begins with a known corner.
                self._advance(events)
        elif self._dwell and not self._is_paused:
            self._dwell -= 1
            if not self._dwell:
                events.append(PlannerEvent(self._chain.popleft().target.id, EventKind.REACHED))
        if self._is_ending and self._time_law.is_stationary:
            events += self.discard()
        return self._q, events

    def _advance(self, events: list[PlannerEvent]) -> None:
        time_law = self._time_law
        s = time_law.step()
        pieces = self._pieces
        while len(pieces) > 1 and s >= pieces[0].end:
            pieces.popleft()
        piece = pieces[0]
        self._q = piece.section.at(piece.share_at(s), self._q).q
        while self._marks and (s >= self._marks[0][0] or time_law.is_at_end):
            event = self._marks.popleft()[1]
            events.append(event)
            if event.kind is EventKind.REACHED:
                self._chain.popleft()
        if time_law.is_at_end:
            self._leave_path()

    def _work(self) -> None:
        """Computes one slice of what is ahead."""
        corner = self._corner
        if corner is not None:
            if not corner.is_done:
                corner.advance()
            if corner.is_done:
                self._corner = None
                if corner.result is not None:
                    self._join(corner.result)
            return
        if self._can_join():
            before, after = self._chain[-1], self._ready[0]
            self._is_corner_tried = True
            self._corner = CornerPreparation(self._arm, before, after)
            return
        preparation = self._preparation
        if preparation is None:
            if not self._waiting or self._refused or len(self._ready) + len(self._chain) >= _AHEAD:
                return
            preparation = self._preparation = Preparation(self._arm, self._waiting[0], self._next_start())
        preparation.advance()
        result = preparation.result
        if result is None:
            return
        self._preparation = None
        if isinstance(result, Refusal):
            self._refused = result
        else:
            self._waiting.popleft()
            self._ready.append(result)

    def _next_start(self) -> Sequence[float]:
        """Returns the joint angles at which the first waiting target begins, [rad]."""
        for targets in (self._ready, self._chain):
            if targets:
                return targets[-1].goal
        return self._q

    def _begin(self, events: list[PlannerEvent]) -> None:
        """Begins the next target of the standing arm."""
        if not self._ready:
            if self._refused is not None:
                target = self._waiting.popleft()
                events.append(PlannerEvent(target.id, EventKind.REFUSED, self._refused))
                events += self.clear_queue()
            return
        prepared = self._ready[0]
        target = prepared.target
        if len(self._ready) == 1 and self._waiting and not self._refused and has_blend(target):
            return  # Until it is known whether the next one can be joined.
        self._ready.popleft()
        began = PlannerEvent(target.id, EventKind.BEGAN)
        self._is_corner_tried = False
        if prepared.section is None:
            events.append(began)
            self._dwell = round(target.seconds / CYCLE_TIME) if isinstance(target, PauseTarget) else 0
            if self._dwell:
                self._chain.append(prepared)
            else:
                events.append(PlannerEvent(target.id, EventKind.REACHED))
            return
        self._chain.append(prepared)
        self._pieces.append(_Piece(prepared.section, prepared.bounds, 0.0, 0.0, prepared.length))
        self._marks.append((0.0, began))
        self._marks.append((prepared.length, PlannerEvent(target.id, EventKind.REACHED)))
        self._time_law.reset()
        self._time_law.set_stretches(self._pieces[-1].stretches())

    def _can_join(self) -> bool:
        if self._is_corner_tried or not (self._pieces and self._chain and self._ready):
            return False
        return can_join(self._chain[-1], self._ready[0])

    def _join(self, corner: Corner) -> None:
        """Appends a corner and the section after it to the path, unless it is too late to slow down for it."""
        blend, last = corner.blend, self._pieces[-1]
        length = 2.0 * (1.0 - blend.exit_share) * last.scale
        begin = last.begin + last.scale * (blend.exit_share - last.share)
        if not self._time_law.can_slow_down(begin, length * corner.bounds[0].velocity):
            return
        prepared = self._ready.popleft()
        section = prepared.section
        assert section is not None
        last.last_share = blend.exit_share
        rounded = _Piece(corner.section, corner.bounds, last.end, 0.0, length)
        after = _Piece(section, prepared.bounds, rounded.end, blend.entry_share, length / (2.0 * blend.entry_share))
        self._pieces += (rounded, after)
        _, reached = self._marks.pop()
        middle = rounded.begin + 0.5 * length
        number = prepared.target.id
        self._marks += (
            (middle, reached),
            (middle, PlannerEvent(number, EventKind.BEGAN)),
            (after.end, PlannerEvent(number, EventKind.REACHED)),
        )
        self._chain.append(prepared)
        self._is_corner_tried = False
        stretches = (s for piece in self._pieces for s in piece.stretches())
        self._time_law.set_stretches([s for s in stretches if s.end > self._time_law.s])

    def _leave_path(self) -> None:
        self._chain.clear()
        self._pieces.clear()
        self._marks.clear()
        self._corner = None
        self._dwell = 0
        self._time_law.reset()

    def _forget_path(self) -> None:
        """Leaves the path before its end: what is prepared begins elsewhere."""
        self._leave_path()
        self._preparation = self._refused = None
