"""The trajectories of clients: targets of the planner, and which of them are planned together."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from rcilab.core.spatial import Pose
from rcilab.sim.channels import Peer
from rcilab.sim.planner import LineTarget, SplineTarget, Target, ToolSpeed

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
    commands: int = 1
    """Of the client, for poses of a spline: each has an event."""


class TrajectoryQueue:
    """Numbers targets, and keeps those that wait for the others of their chain. Owned by the controller."""

    def __init__(self) -> None:
        self._number = 0
        self._known: dict[int, Trajectory] = {}
        self._waiting = defaultdict[Peer | None, list[tuple[Target, Trajectory]]](list)
        self._splines = defaultdict[Peer | None, list[tuple[Pose, Trajectory]]](list)

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

    def is_connecting(self, peer: Peer | None) -> bool:
        """Returns whether a client has commanded targets that wait for others of their chain."""
        return peer in self._waiting or peer in self._splines

    def add(self, target: Target, trajectory: Trajectory) -> list[Target]:
        """Adds a target; returns those that are planned now: none as long as its client is to connect another one."""
        self._waiting[trajectory.peer].append((target, trajectory))
        if trajectory.is_followed_by_another:
            return []
        released = self._waiting.pop(trajectory.peer)
        for waiting, its in released:
            self._known[waiting.id] = its
        return [waiting for waiting, _ in released]

    def add_spline(self, pose: Pose, speed: ToolSpeed, trajectory: Trajectory) -> list[Target]:
        """Adds a pose of a spline; the last one completes it. Fewer than three are reached on straight lines."""
        self._splines[trajectory.peer].append((pose, trajectory))
        if trajectory.is_followed_by_another:
            return []
        poses = tuple(pose for pose, _ in self._splines.pop(trajectory.peer))
        if len(poses) >= FEWEST_SPLINE_POSES:
            spline = SplineTarget(id=self.next_id(), poses=poses, speed=speed)
            return self.add(spline, replace(trajectory, commands=len(poses)))
        for via in poses[:-1]:
            line = LineTarget(id=self.next_id(), pose=via, speed=speed)
            self.add(line, replace(trajectory, is_followed_by_another=True))
        return self.add(LineTarget(id=self.next_id(), pose=pose, speed=speed), trajectory)

    def pop_waiting(self) -> list[Trajectory]:
        """Returns the trajectories that wait for others of their chain, and forgets them."""
        parts = (*self._waiting.values(), *self._splines.values())
        self._waiting.clear()
        self._splines.clear()
        return [trajectory for part in parts for _, trajectory in part]

    def forget(self, peer: Peer) -> None:
        """Forgets what waits of a client that has left."""
        self._waiting.pop(peer, None)
        self._splines.pop(peer, None)
