"""Self-collision avoidance: the error of links that touch.

The maker publishes no distance. The links are the capsules of the generated URDF, which lie inside the housings: no
program that a real arm would carry out is stopped. An arm whose links touch may move them apart.
"""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.i18n.translator import Remark
from rcilab.model.kinematics.collision import ClearanceQuery
from rcilab.model.robot_model import RobotModel

TOLERANCE = 1e-4  # [m] By which links that touch at the start may approach: servo error and rounding.


class SelfCollisionWatch:
    """Observes the distance between the links. Owned by the controller.

    The distance is computed (5 us) where the joints have moved far enough since the last time to close it.

    Args:
        model: The arm.
    """

    def __init__(self, model: RobotModel) -> None:
        geometry = model.collision_geometry()
        self._query = ClearanceQuery(geometry)
        self._levers = geometry.levers
        self._smallest = 0.0
        self._q = model.home
        self._reserve = 0.0

    def begin(self, q: JointVector) -> None:
        """Begins to observe a motion.

        Args:
            q: Measured joint angles, shape (7,), [rad].
        """
        self._smallest = min(0.0, self._query.links(q)[0] - TOLERANCE)
        self._q, self._reserve = q, 0.0

    def step(self, q: JointVector) -> Remark | None:
        """Returns which links touch, or are closer than at the start while they still touch from there, or None.

        Args:
            q: Measured joint angles, shape (7,), [rad].
        """
        if self._levers.dot(np.abs(q - self._q)) < self._reserve:  # No point of the arm has moved farther.
            return None
        distance, links = self._query.links(q)
        if distance > 0.0:  # They have moved apart.
            self._smallest = 0.0
        self._q, self._reserve = q, distance - self._smallest
        return Remark(f"{links} touch", "links_touch") if distance < self._smallest else None
