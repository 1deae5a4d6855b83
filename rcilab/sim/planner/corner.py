"""The rounded corner between two targets, prepared in slices that fit into a cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rcilab.core.errors import KinematicsError
from rcilab.motion.blend import Blend, build_blend
from rcilab.motion.hermite import State
from rcilab.sim.planner.preparation import PlannedArm, PreparedTarget, Sampling, sampled_bounds
from rcilab.sim.planner.section import JointSection, Section, ToolSection, blend_section
from rcilab.sim.planner.section_bounds import ShareBounds
from rcilab.sim.planner.target import JointSpeed, PauseTarget, SplineTarget, Target, ToolSpeed

_SHORTEST = 2e-3  # Part of a section at which a corner may begin before its end; a shorter one is not rounded.
_Side: TypeAlias = JointSection | ToolSection


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Corner:
    """A rounded corner."""

    blend: Blend
    section: Section
    bounds: tuple[ShareBounds, ...]


def has_blend(target: Target) -> bool:
    """Returns whether the corner at the end of a target is to be rounded."""
    return not isinstance(target, SplineTarget | PauseTarget) and max(target.blend.radius, target.blend.share) > 0.0


def can_join(before: PreparedTarget, after: PreparedTarget) -> bool:
    """Returns whether the corner between two targets is to be rounded and both move."""
    return has_blend(before.target) and isinstance(before.section, _Side) and isinstance(after.section, _Side)


class CornerPreparation:
    """Prepares the corner at the end of a target, one slice a cycle. Owned by the planner.

    Attributes:
        is_done: Whether the result is there.
        result: The corner; None once it is done: the targets cannot be joined.

    Args:
        arm: The arm.
        before: The target with the blend.
        after: The next one; see `can_join`.
    """

    def __init__(self, arm: PlannedArm, before: PreparedTarget, after: PreparedTarget) -> None:
        self._arm, self._before, self._after = arm, before, after
        self._blend: Blend | None = None
        self._section: Section | None = None
        self._sampling: Sampling | None = None
        self.result: Corner | None = None
        self.is_done = False

    def advance(self) -> None:
        """Computes the next slice."""
        sampling = self._sampling
        try:
            if self._blend is None:
                self._build()
            elif sampling is None:
                self._begin(self._blend)
            elif not sampling.is_done:
                sampling.advance()
            else:
                self._finish(sampling)
        except KinematicsError:
            self.is_done = True

    def _build(self) -> None:
        before, after = self._sides
        blend = build_blend(self._arm.model, before, after, self._radius(before, after))
        if 1.0 - blend.exit_share < _SHORTEST or blend.entry_share < _SHORTEST:
            self.is_done = True
        self._blend = blend

    def _begin(self, blend: Blend) -> None:
        model, (before, after) = self._arm.model, self._sides
        left = _by_blend(before.state(model, blend.exit_share), 2.0 * (1.0 - blend.exit_share))
        right = _by_blend(after.state(model, blend.entry_share), 2.0 * blend.entry_share)
        self._section = blend_section(blend, left, right, self._arm.solver)
        self._sampling = Sampling(self._section, left[0].tolist(), self._arm.limits.joint)

    @property
    def _sides(self) -> tuple[_Side, _Side]:
        before, after = self._before.section, self._after.section
        assert isinstance(before, _Side)
        assert isinstance(after, _Side)
        return before, after

    def _radius(self, before: _Side, after: _Side) -> float:
        target = self._before.target
        assert not isinstance(target, SplineTarget | PauseTarget)
        if target.blend.radius > 0.0:
            return target.blend.radius
        model = self._arm.model
        corner, *middles = (
            section.positions(model, np.array([share]))[0]
            for section, share in ((after, 0.0), (before, 0.5), (after, 0.5))
        )
        return target.blend.share * min(float(np.linalg.norm(middle - corner)) for middle in middles)

    def _finish(self, sampling: Sampling) -> None:
        self.is_done = True
        blend, section = self._blend, self._section
        assert blend is not None
        assert section is not None
        if sampling.refusal is not None:
            return
        exit_rate, entry_rate = 2.0 * (1.0 - blend.exit_share), 2.0 * blend.entry_share  # Shares by that of the blend.
        line = _slower(
            _scaled(_bounds_at(self._before.bounds, blend.exit_share), exit_rate),
            _scaled(_bounds_at(self._after.bounds, blend.entry_share), entry_rate),
        )
        speeds = self._before.speed, self._after.speed
        joints = [speed for speed in speeds if isinstance(speed, JointSpeed)]
        tools = [speed for speed in speeds if isinstance(speed, ToolSpeed)]
        bounds = sampled_bounds(self._arm, sampling, line, joints=joints, tools=tools)
        self.result = Corner(blend=blend, section=section, bounds=tuple(bounds))


def _by_blend(state: State, rate: float) -> State:
    """Returns a state with derivatives by the share of the blend."""
    return state[0], rate * state[1], rate**2 * state[2]


def _bounds_at(bounds: tuple[ShareBounds, ...], share: float) -> ShareBounds:
    return next((part for part in bounds if part.end >= share), bounds[-1])


def _scaled(bounds: ShareBounds, rate: float) -> ShareBounds:
    return ShareBounds(1.0, bounds.velocity / rate, bounds.acceleration / rate, bounds.jerk / rate)


def _slower(a: ShareBounds, b: ShareBounds) -> ShareBounds:
    return ShareBounds(1.0, *(min(x, y) for x, y in zip(a[1:], b[1:], strict=True)))
