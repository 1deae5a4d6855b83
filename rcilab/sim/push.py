"""An external force and moment at a point of a link."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointVector, as_vector
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import RobotModel
from rcilab.robots.upright import upright_flange


class Push:
    """A wrench on the arm that moves with its link and keeps its direction. Immutable.

    Args:
        model: The arm with its tool.
        wrench: Force and moment on the arm, base axes, shape (6,), [N, N m].
        link: Number of the link, from 1; None: the tool.
        point: Where the force acts, in the link's frame (or the tool's), shape (3,), [m]; None: its origin.

    Raises:
        InvalidValueError: The values are not six and three finite numbers, or the link does not exist.
    """

    def __init__(
        self, model: RobotModel, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None
    ) -> None:
        self.wrench: Array = as_vector(wrench, 6, "wrench", "N, N m")
        self.link = link
        self.is_active = bool(self.wrench.any())
        self._given = np.zeros(3) if point is None else as_vector(point, 3, "point", "m")
        if link is not None and (isinstance(link, bool) or link not in range(1, model.n + 1)):
            raise InvalidValueError(
                "link", link, f"needs one of the moving links of {model.name}, 1 to {model.n}"
            ).coded("span", low="1", high=str(model.n))
        self._model = model
        T = upright_flange(model.description) @ model.T_flange_tool
        self._body = model.n if link is None else link
        self._point = T.rotation @ self._given + T.position if link is None else self._given

    def on(self, model: RobotModel) -> Push:
        """Returns the same push on the same arm with another tool or load."""
        return Push(model, self.wrench, self.link, self._given)

    def torque(self, q: JointVector) -> JointVector:
        """Returns the joint torques J^T w, shape (n,), [N m]."""
        return self._model.rigid_body.link_jacobian(q, self._body, self._point).T @ self.wrench
