"""The motion along a path: its length as a function of time, which may stop, continue and slow down at any time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rcilab.core.clock import CYCLE_TIME
from rcilab.motion import _ruckig
from rcilab.sim.planner.velocity_change import change_distance, fastest_after, fastest_before, slowest_after

_ROUNDING = 1.0 - 1e-7  # ruckig refuses a target velocity above its bound, and solves with a tolerance.
_ENOUGH = 1.0 + 1e-6
_TOLERANCE = 2e-8  # Of path lengths: ruckig ends up to 1e-8 from a position.
_SMALLEST = 1e-9  # Part of a stretch's velocity below which it stands still.


class Stretch(NamedTuple):
    """A part of the path with constant bounds."""

    end: float
    """Path length at its end."""
    velocity: float
    """Bound, above zero, per second."""
    acceleration: float
    """Bound, above zero."""
    jerk: float
    """Bound, above zero."""


class PathTimeLaw:
    """Moves along stretches, each with its own bounds, without a stop between them, to standstill at the last end.

    At the end of a stretch the acceleration is zero, and the velocity as high as both stretches and those ahead allow.
    Stretches may be appended or replaced, also the present one, as long as a stop before the last end stays possible.
    Owned by the thread of the cycle.
    """

    def __init__(self) -> None:
        self._line = _ruckig.PathStepper()
        self._stretches: list[Stretch] = []
        self._junctions: list[float] = []  # Velocity at the end of each stretch.
        self._override = 1.0
        self._is_braking = False
        self._is_adapting = False  # Whether the aim depends on the present state.

    @property
    def s(self) -> float:
        """Path length."""
        return self._line.s

    @property
    def ds(self) -> float:
        """Velocity, per second."""
        return self._line.ds

    @property
    def dds(self) -> float:
        """Acceleration."""
        return self._line.dds

    @property
    def is_stationary(self) -> bool:
        """Whether it stands."""
        velocity, acceleration = self._scale
        return abs(self._line.ds) < _SMALLEST * velocity and abs(self._line.dds) < _SMALLEST * acceleration

    @property
    def is_at_end(self) -> bool:
        """Whether it stands at the end of the last stretch, or no stretch exists."""
        return not self._stretches

    def reset(self) -> None:
        """Begins a new path, at standstill at length zero."""
        self._line = _ruckig.PathStepper()
        self._stretches, self._junctions = [], []
        self._is_braking = False

    def set_stretches(self, stretches: Sequence[Stretch]) -> None:
        """Replaces everything ahead; the first stretch contains the present length."""
        self._stretches = list(stretches)
        self._plan()

    def can_slow_down(self, s: float, ds: float) -> bool:
        """Returns whether it can have a velocity, or a smaller one, at a path length, inside the present bounds."""
        if not self._stretches:
            return False
        line = self._line
        _, _, acceleration, jerk = self._stretches[0]
        left = s - line.s - line.ds * CYCLE_TIME
        if left <= 0.0:
            return False
        return line.ds <= ds or change_distance(line.ds, line.dds, ds, acceleration, jerk) <= left

    def set_override(self, part: float) -> None:
        """Multiplies every velocity bound from now on; above 0, up to 1."""
        if part != self._override:
            self._override = part
            self._plan()

    def pause(self) -> None:
        """Stops inside the bounds of the stretch, on the path."""
        self._is_braking = True
        self._aim()

    def resume(self) -> None:
        """Continues from the present state."""
        self._is_braking = False
        self._plan()

    def step(self) -> float:
        """Advances one cycle and returns the path length."""
        line = self._line
        if not self._stretches:
            return line.s
        if self._is_adapting and not self._is_braking:
            self._aim()
        if not line.step():
            _, _, acceleration, jerk = self._stretches[0]
            line.change_to(0.0, acceleration, jerk)
            line.step()
            self._plan()
        stretches = self._stretches
        while len(stretches) > 1 and line.s >= stretches[0].end - (_TOLERANCE if line.ds <= _SMALLEST else 0.0):
            del stretches[0], self._junctions[0]
            if line.dds and not self._is_braking:
                self._plan()
            else:
                self._aim()
        if len(stretches) == 1 and not self._is_braking:
            end = stretches[0].end
            if abs(line.s - end) < 2.0 * _TOLERANCE and self.is_stationary:
                self._stretches, self._junctions = [], []
                self._line = _ruckig.PathStepper(end)
        return self._line.s

    @property
    def _scale(self) -> tuple[float, float]:
        if not self._stretches:
            return 1.0, 1.0
        _, velocity, acceleration, _ = self._stretches[0]
        return velocity, acceleration

    def _plan(self) -> None:
        """Computes the velocities at the ends of the stretches: backwards from standstill, then forwards."""
        stretches, line = self._stretches, self._line
        if not stretches:
            return
        caps = [self._override * stretch.velocity for stretch in stretches]
        junctions = [0.0] * len(stretches)
        reachable = [0.0] * len(stretches)  # From where a stop at the last end is possible.
        for k in range(len(stretches) - 2, -1, -1):
            _, _, acceleration, jerk = stretches[k + 1]
            reachable[k] = _fastest(junctions[k + 1], stretches[k + 1].end - stretches[k].end, acceleration, jerk)
            junctions[k] = _ROUNDING * min(caps[k], caps[k + 1], reachable[k])
        v, a, s = max(0.0, line.ds), line.dds, line.s  # Braking may end a rounding below zero.
        for k, (end, _, acceleration, jerk) in enumerate(stretches[:-1]):
            junctions[k] = _junction(v, a, end - s, junctions[k], reachable[k], acceleration, jerk)
            v, a, s = junctions[k], 0.0, end
        self._junctions = junctions
        self._aim()

    def _aim(self) -> None:
        if not self._stretches:
            return
        line = self._line
        end, velocity, acceleration, jerk = self._stretches[0]
        if self._is_braking:
            line.change_to(0.0, acceleration, jerk)
            return
        junction, cap = self._junctions[0], self._override * velocity
        v, a, left = line.ds, line.dds, end - line.s
        self._is_adapting = True
        needed = change_distance(v, a, junction, acceleration, jerk)
        if needed > left + _TOLERANCE and len(self._stretches) > 1:
            # It passes the end with an acceleration: the stretch is too short, or its bounds are new.
            line.change_to(max(0.0, v + a * abs(a) / (2.0 * jerk)), acceleration, jerk)
            return
        if needed > left - _TOLERANCE and not self.is_stationary:
            line.change_to(junction, acceleration, jerk)
            return
        peak = v + max(0.0, a) ** 2 / (2.0 * jerk)
        if peak > cap * _ENOUGH:  # After a change of the override.
            slowed = change_distance(v, a, cap, acceleration, jerk)
            if slowed + change_distance(cap, 0.0, junction, acceleration, jerk) < left - cap * CYCLE_TIME:
                line.change_to(cap, acceleration, jerk)
                return
            cap = peak * _ENOUGH
        else:
            self._is_adapting = False
        line.aim_at(end, junction, max(cap, junction), acceleration, jerk)


def _junction(
    v: float, a: float, length: float, wanted: float, reachable: float, acceleration: float, jerk: float
) -> float:
    """Returns the velocity at the end of a stretch that is closest to the wanted one.

    Args:
        v: Velocity at its begin, or now.
        a: Acceleration there.
        length: Path length from there to the end.
        wanted: The velocity to have at the end.
        reachable: Largest velocity there from which a stop at the last end is possible.
        acceleration: Bound.
        jerk: Bound.
    """
    if a == 0.0 and wanted > v:
        return min(wanted, _fastest(v, length, acceleration, jerk))
    length += _TOLERANCE
    if change_distance(v, a, wanted, acceleration, jerk) <= length:
        return wanted
    if wanted >= v + a * abs(a) / (2.0 * jerk):
        return fastest_after(v, a, length, wanted, acceleration, jerk)
    # After a change of the override, or of the path ahead, it slows down as fast as it may.
    slowest = slowest_after(v, a, length, wanted, acceleration, jerk)
    if slowest > reachable and change_distance(v, a, 0.0, acceleration, jerk) <= length:
        return 0.0  # A change to standstill is shorter than one to a small velocity.
    return slowest


def _fastest(w: float, length: float, acceleration: float, jerk: float) -> float:
    """Returns the largest velocity at one end of a stretch, for a velocity at the other.

    A stretch begins at the first cycle in it, up to a cycle's distance behind its beginning.
    """
    first = fastest_before(w, length, acceleration, jerk)
    return fastest_before(w, max(0.0, length - max(first, w) * CYCLE_TIME), acceleration, jerk)
