"""Check of distances between links, from floor and obstacles, cycle by cycle; no controller has it."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.cell.cell import Cell, has_obstacles
from rcilab.cell.clearance_path import sample_cycle
from rcilab.cell.clearance_query import build_query
from rcilab.conformance.clearance_conditions import clearance_conditions
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.arrays import JointVector, as_vector
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit, LinkPair
from rcilab.model.robot_model import RobotModel


class ClearanceMonitor:
    """Checks one commanded position per cycle by the same rows as `check`, at the same points of the path.

    Owned by the thread that runs the cycle. A step takes about 20 us.

    Attributes:
        distance: Smallest distance in the last step, [m].
        links: The two links of that distance.

    Args:
        model: The arm.
        distance: Required distances. The monitor starts at `model.home`; `reset` sets another position.
        cell: The cell of the arm; None without one.
    """

    def __init__(
        self, model: RobotModel, distance: ClearanceLimit = STANDARD_DISTANCE, cell: Cell | None = None
    ) -> None:
        self._n, self._has_obstacles = model.n, has_obstacles(cell)
        self._query, self._levers = build_query(model, distance, cell)
        rows = clearance_conditions(distance, has_obstacles=self._has_obstacles)
        self._rows = [(row, float(row.bounds(model.limits)[0][0])) for row in rows]
        self.reset(model.home)

    def reset(self, q: Sequence[float] | JointVector) -> None:
        """Restarts the history at standstill at `q`.

        Args:
            q: Joint angles, n numbers, [rad].

        Raises:
            InvalidValueError: Not n finite numbers.
        """
        self._q: JointVector = as_vector(q, self._n, "q", "rad")
        self._measure()

    def step(self, q_c: Sequence[float] | JointVector) -> bool:
        """Checks the commanded angles of this cycle and returns whether every necessary condition holds.

        Args:
            q_c: Commanded joint angles, n numbers, [rad].

        Raises:
            InvalidValueError: Not n finite numbers.
        """
        before, self._q = self._q, as_vector(q_c, self._n, "q_c", "rad")
        self._measure(before)
        return not any(row.necessity == "necessary" for row, *_ in self.violations())

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step, also of recommended rows."""
        found: list[LimitViolation] = []
        for row, minimum in self._rows:
            distance, links = self._found[row.signal]
            if not minimum < distance:
                found.append(LimitViolation(row, 0, distance, minimum, links))
        return found

    def _measure(self, before: JointVector | None = None) -> None:
        start = self._q if before is None else before
        samples = sample_cycle(start, self._q, self._levers)
        self._found: dict[str, tuple[float, LinkPair]] = {
            "link_distance": min(self._query.links(q) for q in samples),
            "floor_distance": min(self._query.floor(q) for q in samples),
        }
        if self._has_obstacles:
            self._found["cell_distance"] = min(self._query.cell(q) for q in samples)
        self.distance, self.links = min(self._found.values())
