"""The trajectories of clients: targets of the planner, and which of them are planned together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.sim.channels import Peer
from rcilab.sim.planner import SplineTarget, Target, ToolSpeed

TrajectoryKind: TypeAlias = Literal["movej", "movel", "movec", "moves"]
FEWEST_SPLINE_POSES = 3


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Trajectory:
    """A motion command of a client."""

    kind: TrajectoryKind
    peer: Peer | None
    """Who is notified of its end."""
    is_followed_by_another: bool = False
    """Whether the next one is planned together with it."""


class TrajectoryQueue:
    """Numbers targets, and keeps those that wait for the others of their chain. Owned by the controller."""

    def __init__(self) -> None:
        self._number = 0
        self._known: dict[int, Trajectory] = {}
        self._waiting: list[tuple[Target, Trajectory]] = []
        self._spline: list[Pose] = []

    def next_id(self) -> int:
        """Returns the number of the next target."""
        self._number += 1
        return self._number

    def find(self, number: int) -> Trajectory | None:
        """Returns the trajectory of a target."""
        return self._known.get(number)

    def pop(self, number: int) -> Trajectory | None:
        """Returns the trajectory of a target that has ended."""
        return self._known.pop(number, None)

    def pop_all(self) -> list[Trajectory]:
        """Returns the trajectories that have not ended, and forgets them."""
        known, self._known = list(self._known.values()), {}
        return known

    def add(self, target: Target, trajectory: Trajectory) -> list[Target]:
        """Adds a target; returns those that are planned now: none as long as another one is to be connected."""
        self._waiting.append((target, trajectory))
        if trajectory.is_followed_by_another:
            return []
        released, self._waiting = self._waiting, []
        for waiting, its in released:
            self._known[waiting.id] = its
        return [waiting for waiting, _ in released]

    def add_spline(self, pose: Pose, speed: ToolSpeed, trajectory: Trajectory) -> list[Target]:
        """Adds a pose of a spline; the last one completes it.

        Raises:
            InvalidValueError: It is the last one, and there are too few.
        """
        self._spline.append(pose)
        if trajectory.is_followed_by_another:
            return []
        poses, self._spline = tuple(self._spline), []
        if len(poses) < FEWEST_SPLINE_POSES:
            raise InvalidValueError("poses", len(poses), f"a spline needs at least {FEWEST_SPLINE_POSES} poses")
        return self.add(SplineTarget(id=self.next_id(), poses=poses, speed=speed), trajectory)

    def clear(self) -> None:
        """Forgets all that wait."""
        self._waiting.clear()
        self._spline.clear()
