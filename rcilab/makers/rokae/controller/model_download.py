"""The values in the answer to LoadRobotModel, in the format of the vendor's model library.

Geometry is the DH table in millimetres. Dynamics are base parameters: the smallest set of numbers that determines the
torques of a 7-axis arm. They are computed from the arm's own rigid-body model by least squares over random states,
which is exact because these span it (Khalil and Dombre, Modeling, Identification and Control of Robots, 2002, chapter
9). So gravity compensation in a vendor program agrees with the arm, with one exception: in its calls without
friction the vendor's library replaces the last two numbers, the first moments of link 7, by constants. Friction is
served as zero: the library misplaces it in one call and would use viscous friction as an offset.

The vendor's library does not support the 6-axis arms; they get their geometry, and zeros for dynamics.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.makers.rokae.wire import ModelResponse
from rcilab.model.robot_model import RobotModel
from rcilab.robots import RobotDescription

GRAVITY = 9.81  # [m/s^2] Along the base's -z; as in the vendor's library.
_STATES = 20  # 7 equations each for 43 unknowns: three times as many as needed.

_ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "mx", "my", "mz")
"""One link's parameters: inertia about the DH frame's origin in link axes, then first moments."""
_SERVED = (
    ("Iyy",),
    *(("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "mx", "mz"),) * 5,
    ("Ixx", "Ixy", "Ixz", "Iyz", "Izz", "mx", "my"),
)
"""The parameters of each link that are not determined by those of others: as sent by the vendor's controller."""
_COLUMNS = tuple(9 * link + _ENTRIES.index(name) for link, names in enumerate(_SERVED) for name in names)


def model_response(arm: RobotDescription) -> ModelResponse:
    """Returns the answer to LoadRobotModel."""
    rows = [(1000.0 * row.a, row.alpha, 1000.0 * row.d, row.theta_offset) for row in arm.dh]
    dh = [number for row in rows for number in row] + [0.0] * (28 - 4 * arm.n)
    parameters = base_parameters(arm) if arm.n == len(_SERVED) else np.zeros(len(_COLUMNS))
    return ModelResponse(
        dh=tuple(dh),
        dynamics_with_friction=_in_blocks(parameters, unused=2, friction=3),
        dynamics=_in_blocks(parameters, unused=2, friction=0),
    )


@lru_cache(maxsize=4)
def base_parameters(arm: RobotDescription) -> Array:
    """Returns the 43 base parameters of a 7-axis arm without load, [kg m^2] and [kg m]."""
    model = RobotModel(arm)
    random = np.random.default_rng(7)
    q, dq, ddq = (random.uniform(-2.0, 2.0, (_STATES, arm.n)) for _ in range(3))
    equations = np.concatenate([regressor(model, *state) for state in zip(q, dq, ddq, strict=True)])
    torques = np.concatenate([model.torque(*state).full for state in zip(q, dq, ddq, strict=True)])
    return np.asarray(np.linalg.lstsq(equations, torques, rcond=None)[0], dtype=np.float64)


def regressor(model: RobotModel, q: JointVector, dq: JointVector, ddq: JointVector) -> Array:
    """Returns the matrix that gives the joint torques from the 43 base parameters, shape (n, 43).

    Newton-Euler in base axes, link by link: Siciliano et al., Robotics (2009), section 7.5, with inertias about the
    frames' origins. Column k holds the torques of an arm of which parameter k is 1 and all others are 0.

    Args:
        model: The arm.
        q: Joint angles, shape (n,), [rad].
        dq: Joint velocities, shape (n,), [rad/s].
        ddq: Joint accelerations, shape (n,), [rad/s^2].
    """
    axes, origins = [np.array([0.0, 0.0, 1.0])], [np.zeros(3)]
    w, dw, a = np.zeros(3), np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    found = np.zeros((model.n, 9 * model.n))
    for link, frame in enumerate(model.joint_frames(q)):
        axis, R, origin = axes[-1], frame.rotation, frame.position
        dw = dw + axis * ddq[link] + _skew(w) @ axis * dq[link]
        w = w + axis * dq[link]
        turning = _skew(dw) + _skew(w) @ _skew(w)
        a = a + turning @ (origin - origins[-1])
        force = np.hstack((np.zeros((3, 6)), turning @ R))
        spin = R @ (_tensor_times(R.T @ dw) + _skew(R.T @ w) @ _tensor_times(R.T @ w))
        moment = np.hstack((spin, -_skew(a) @ R))
        for joint, (z, start) in enumerate(zip(axes, origins, strict=True)):
            found[joint, 9 * link : 9 * link + 9] = z @ moment + (_skew(z) @ (origin - start)) @ force
        axes.append(R[:, 2])
        origins.append(origin)
    return found[:, _COLUMNS]


def _skew(v: Array) -> Array:
    """Returns the matrix of the cross product with v from the left."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _tensor_times(v: Array) -> Array:
    """Returns the matrix that gives I @ v from (Ixx, Ixy, Ixz, Iyy, Iyz, Izz), shape (3, 6)."""
    x, y, z = v
    return np.array([[x, y, z, 0.0, 0.0, 0.0], [0.0, x, 0.0, y, z, 0.0], [0.0, 0.0, x, 0.0, y, z]])


def _in_blocks(parameters: Array, *, unused: int, friction: int) -> tuple[float, ...]:
    """Returns the parameters joint by joint, with zeros for the unused entries of joint 1 and for friction."""
    numbers = parameters.tolist()
    blocks = [numbers[:1] + [0.0] * unused]
    blocks += [numbers[start : start + 7] for start in range(1, len(numbers), 7)]
    return tuple(number for block in blocks for number in block + [0.0] * friction)
