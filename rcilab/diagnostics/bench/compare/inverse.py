"""Inverse kinematics of the same random poses by every installed package, with the accuracy of the solutions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import UnreachableError
from rcilab.diagnostics.bench.compare import closed_form, iterative
from rcilab.diagnostics.bench.compare.peer import Solver, absent
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.model.robot_model import RobotModel

CLOSE_ENOUGH = 1e-3
"""[m] and [rad]. A solution this close to the pose, inside the joint limits, counts as solved."""
_NEARBY = 0.1  # [rad] Largest distance of every joint from the solution, for an arm that follows a target.
_TURN = 50
"""Poses per turn of a solver: enough for its code and data to be in the cache."""
_SEED = 20
_ONE = {
    "rcilab": closed_form.rcilab_nearest,
    "ssik": closed_form.ssik_nearest,
    "pinocchio": iterative.clik,
    "pink": iterative.pink,
}
"""Solvers for one solution near the arm's position."""
_ALL = {"rcilab": closed_form.rcilab_branches, "ssik": closed_form.ssik_branches}
"""Solvers for all solutions at the same number of arm angles."""


@dataclass(slots=True)
class Tally:
    """Results of one solver over all poses."""

    seconds: list[float] = field(default_factory=list)
    """Processor times, which other load on the machine affects least."""
    answers: int = 0
    """Number of solutions, correct or not."""
    solved: int = 0
    """Poses with a solution inside the limits that is close enough."""
    outside: int = 0
    """Poses whose solutions reach the pose, but all beyond a joint limit."""
    position_error: float = 0.0
    """Largest position error of the counted solutions, [m]."""
    rotation_error: float = 0.0
    """Largest rotation error of the counted solutions, [rad]."""

    def score(self, model: RobotModel, T: Array, answers: Sequence[JointVector] | Array) -> None:
        """Adds the solutions of one pose.

        Args:
            model: The arm.
            T: The pose, shape (4, 4).
            answers: Joint angles, [rad], m of them.
        """
        self.answers += len(answers)
        if not len(answers):
            return
        q = np.asarray(answers, dtype=np.float64)
        position, rotation = pose_errors(model.forward_path(q), T)
        close = (position < CLOSE_ENOUGH) & (rotation < CLOSE_ENOUGH)
        joint = model.limits.joint
        good = close & ((q > joint.lower) & (q < joint.upper)).all(axis=1)
        if good.any():
            self.solved += 1
            self.position_error = max(self.position_error, float(position[good].max()))
            self.rotation_error = max(self.rotation_error, float(rotation[good].max()))
        elif close.any():
            self.outside += 1


def compare_inverse(model: RobotModel, count: int = 1000) -> Iterator[Measurement | Absent]:
    """Yields the results of every package for random reachable poses: from home, from nearby, and all branches.

    Args:
        model: A 7-axis arm without a tool.
        count: Number of poses.
    """
    joint = model.limits.joint
    random = np.random.default_rng(_SEED)
    q = random.uniform(0.98 * joint.lower, 0.98 * joint.upper, (count, model.n))
    nearby = np.clip(q + random.uniform(-_NEARBY, _NEARBY, q.shape), 0.98 * joint.lower, 0.98 * joint.upper)
    home = np.tile(model.home, (count, 1))
    yield from _rows("home", _ONE, model, q, home)
    yield from _rows("near", _ONE, model, q, nearby)
    yield from _rows("branches", _ALL, model, q, home)
    yield _batch(model, q)


def pose_errors(T: Array, target: Array) -> tuple[Array, Array]:
    """Returns the distances, [m], and the rotation angles, [rad], of poses from a target pose.

    Args:
        T: Poses, shape (m, 4, 4).
        target: The target, shape (4, 4).
    """
    between = np.swapaxes(T[:, :3, :3], 1, 2) @ target[:3, :3]
    axis = (between - np.swapaxes(between, 1, 2))[:, (2, 0, 1), (1, 2, 0)]
    angle = np.arctan2(np.linalg.norm(axis, axis=1), np.trace(between, axis1=1, axis2=2) - 1.0)
    return np.linalg.norm(T[:, :3, 3] - target[:3, 3], axis=1), angle


def _rows(
    task: str, makers: Mapping[str, Callable[[RobotModel], Solver]], model: RobotModel, q: JointPath, start: JointPath
) -> Iterator[Measurement | Absent]:
    """Yields one row per solver; they alternate, so that other load on the machine affects all of them."""
    solvers: dict[str, Solver | Absent] = {}
    for who, maker in makers.items():
        try:
            solvers[who] = maker(model)
        except ModuleNotFoundError as error:
            solvers[who] = absent(f"{task}/{who}", error)
    present = [(solver, Tally()) for solver in solvers.values() if isinstance(solver, Solver)]
    poses = model.forward_path(q)
    for solver, _ in present:  # Excludes the cost of the first call.
        _answers(solver, poses[0], start[0])
    for first in range(0, len(q), _TURN):
        turn = slice(first, first + _TURN)
        for solver, tally in present:
            for T, near in zip(poses[turn], start[turn], strict=True):
                begin = time.process_time_ns()
                answers = _answers(solver, T, near)
                tally.seconds.append((time.process_time_ns() - begin) * 1e-9)
                tally.score(model, T, answers)
    measured = iter(present)
    for who, solver in solvers.items():
        yield solver if isinstance(solver, Absent) else _summary(f"{task}/{who}", *next(measured))


def _answers(solver: Solver, T: Array, near: JointVector) -> Sequence[JointVector] | Array:
    try:
        return solver.solve(T, near)
    except UnreachableError:
        return ()


def _summary(name: str, solver: Solver, tally: Tally) -> Measurement:
    count = len(tally.seconds)
    outside = f" ({tally.outside} beyond a joint limit)" if tally.outside else ""
    several = f", {tally.answers / count:.0f} solutions per pose" if tally.answers > count else ""
    note = (
        f"{solver.about}: {tally.solved} of {count} solved{outside}{several}; largest error "
        f"{tally.position_error:.1e} m, {tally.rotation_error:.1e} rad; fastest tenth "
        f"{1e6 * float(np.percentile(tally.seconds, 10)):.0f} us"
    )
    return summarise(name, tally.seconds, "us", None, note)


def _batch(model: RobotModel, q: JointPath) -> Measurement:
    """Returns the time per pose of rcilab for the same branches of all poses in one call."""
    count, angles = len(q), closed_form.ARM_ANGLES
    poses = np.repeat(model.forward_path(q), angles, axis=0)
    psi = np.tile(np.arange(angles) * (2.0 * np.pi / angles), count)
    model.inverse_batch(poses, psi)
    times: list[float] = []
    for _ in range(5):
        begin = time.process_time()
        model.inverse_batch(poses, psi)
        times.append(time.process_time() - begin)
    note = f"the same for {count} poses at {angles} arm angles in one call, time per pose; the others have no batches"
    return summarise("branches/batch", np.array(times) / count, "us", None, note)
