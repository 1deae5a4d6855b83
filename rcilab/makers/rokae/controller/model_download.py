"""The values in the answer to LoadRobotModel, in the format of the vendor's model library.

Geometry is the DH table in millimetres. Dynamics are base parameters, computed from the arm's own rigid-body model by
least squares over random states, which is exact because these span it. So gravity compensation in a vendor program
agrees with the arm, with one exception: in its calls without friction the vendor's library replaces the last two
numbers, the first moments of link 7, by constants. Of friction, the Coulomb friction of the joints is served; the
viscous one is compensated by the drives, and the library would use it as an offset in one call.

The vendor's library does not support the 6-axis arms; they get their geometry, and zeros for dynamics.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Array
from rcilab.makers.rokae.base_parameters import COLUMNS, SERVED, base_parameters
from rcilab.makers.rokae.wire import ModelResponse
from rcilab.robots import RobotDescription


def model_response(arm: RobotDescription, coulomb: Sequence[float] | None = None) -> ModelResponse:
    """Returns the answer to LoadRobotModel.

    Args:
        arm: The arm.
        coulomb: Coulomb friction of its joints, n numbers, [N m]; None: they have none.
    """
    rows = [(1000.0 * row.a, row.alpha, 1000.0 * row.d, row.theta_offset) for row in arm.dh]
    dh = [number for row in rows for number in row] + [0.0] * (28 - 4 * arm.n)
    is_supported = arm.n == len(SERVED)
    parameters = base_parameters(arm) if is_supported else np.zeros(len(COLUMNS))
    rubbing = coulomb if coulomb is not None and is_supported else (0.0,) * len(SERVED)
    return ModelResponse(
        dh=tuple(dh),
        dynamics_with_friction=_in_blocks(parameters, unused=2, friction=[(0.0, level, 0.0) for level in rubbing]),
        dynamics=_in_blocks(parameters, unused=2, friction=[()] * len(SERVED)),
    )


def _in_blocks(parameters: Array, *, unused: int, friction: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    """Returns the parameters and the friction joint by joint, with zeros for the unused entries of joint 1."""
    numbers = parameters.tolist()
    blocks = [numbers[:1] + [0.0] * unused]
    blocks += [numbers[start : start + 7] for start in range(1, len(numbers), 7)]
    return tuple(
        number for block, coefficients in zip(blocks, friction, strict=True) for number in (*block, *coefficients)
    )
