"""Solver for 6 axes with parallel axes 2 and 3 and an offset wrist, such as the xArm6: up to 16 branches."""

from __future__ import annotations

from functools import partial

from rcilab.model.kinematics.solvers.closed_form import ClosedForm
from rcilab.model.kinematics.solvers.offset6.arm import OffsetSixGeometry
from rcilab.model.kinematics.solvers.offset6.inverse import solve_poses
from rcilab.model.kinematics.solvers.solver import Envelope
from rcilab.robots.description import RobotDescription


class OffsetSix(ClosedForm):
    """The solver of arms with the geometry of `build_offset_six`."""

    def __init__(self, description: RobotDescription, geometry: OffsetSixGeometry) -> None:
        envelope = Envelope(
            shoulder=geometry.shoulder,
            upper=geometry.upper,
            fore=geometry.fore + abs(geometry.wrist) + abs(geometry.ahead),
            hand=geometry.hand,
        )
        super().__init__(description, envelope, partial(solve_poses, geometry))
        self.geometry = geometry
