"""The base parameters of a 7-axis arm: the smallest set of numbers that determines its torques.

They are moments of inertia about the origin of the Denavit-Hartenberg frame after a joint, in its axes, and first
moments; those that do not appear are contained in others (Khalil and Dombre, Modeling, Identification and Control of
Robots, 2002, chapter 9). The vendor's controller sends 43 of them in the answer to LoadRobotModel.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.model.robot_model import RobotModel
from rcilab.robots import RobotDescription

GRAVITY = 9.81  # [m/s^2] Along the base's -z; as in the vendor's library.
_STATES = 20  # 7 equations each for 43 unknowns: three times as many as needed.

ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "mx", "my", "mz", "m")
"""One link's parameters: inertia about the DH frame's origin in its axes, first moments, mass."""
SERVED = (
    ("Iyy",),
    *(("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "mx", "mz"),) * 5,
    ("Ixx", "Ixy", "Ixz", "Iyz", "Izz", "mx", "my"),
)
"""The parameters of each link that are not determined by those of others: as sent by the vendor's controller."""
COLUMNS = tuple(len(ENTRIES) * link + ENTRIES.index(name) for link, names in enumerate(SERVED) for name in names)


@lru_cache(maxsize=4)
def base_parameters(arm: RobotDescription) -> Array:
    """Returns the 43 base parameters of a 7-axis arm without load, [kg m^2] and [kg m]."""
    model, states = RobotModel(arm), random_states(arm.n)
    equations = np.concatenate([regressor(model, *state) for state in states])
    torques = np.concatenate([model.torque(*state).full for state in states])
    return np.asarray(np.linalg.lstsq(equations, torques, rcond=None)[0], dtype=np.float64)


@lru_cache(maxsize=4)
def regrouping(arm: RobotDescription) -> Array:
    """Returns the matrix that gives the base parameters of an arm from all parameters of its links, shape (43, 70)."""
    model, states = RobotModel(arm), random_states(arm.n)
    equations = np.concatenate([full_regressor(model, *state) for state in states])
    return np.asarray(np.linalg.lstsq(equations[:, COLUMNS], equations, rcond=None)[0], dtype=np.float64)


def random_states(n: int) -> list[tuple[JointVector, JointVector, JointVector]]:
    """Returns joint angles, velocities and accelerations that excite all parameters, the same in every call."""
    random = np.random.default_rng(7)
    q, dq, ddq = (random.uniform(-2.0, 2.0, (_STATES, n)) for _ in range(3))
    return list(zip(q, dq, ddq, strict=True))


def regressor(model: RobotModel, q: JointVector, dq: JointVector, ddq: JointVector) -> Array:
    """Returns the matrix that gives the joint torques from the 43 base parameters, shape (n, 43); see the full one."""
    return full_regressor(model, q, dq, ddq)[:, COLUMNS]


def full_regressor(model: RobotModel, q: JointVector, dq: JointVector, ddq: JointVector) -> Array:
    """Returns the matrix that gives the joint torques from all parameters of all links, shape (n, 10 n).

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
    found = np.zeros((model.n, len(ENTRIES) * model.n))
    for link, frame in enumerate(model.joint_frames(q)):
        axis, R, origin = axes[-1], frame.rotation, frame.position
        dw = dw + axis * ddq[link] + _skew(w) @ axis * dq[link]
        w = w + axis * dq[link]
        turning = _skew(dw) + _skew(w) @ _skew(w)
        a = a + turning @ (origin - origins[-1])
        force = np.hstack((np.zeros((3, 6)), turning @ R, a[:, None]))
        spin = R @ (_tensor_times(R.T @ dw) + _skew(R.T @ w) @ _tensor_times(R.T @ w))
        moment = np.hstack((spin, -_skew(a) @ R, np.zeros((3, 1))))
        for joint, (z, start) in enumerate(zip(axes, origins, strict=True)):
            found[joint, len(ENTRIES) * link : len(ENTRIES) * (link + 1)] = (
                z @ moment + (_skew(z) @ (origin - start)) @ force
            )
        axes.append(R[:, 2])
        origins.append(origin)
    return found


def _skew(v: Array) -> Array:
    """Returns the matrix of the cross product with v from the left."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _tensor_times(v: Array) -> Array:
    """Returns the matrix that gives I @ v from (Ixx, Ixy, Ixz, Iyy, Iyz, Izz), shape (3, 6)."""
    x, y, z = v
    return np.array([[x, y, z, 0.0, 0.0, 0.0], [0.0, x, 0.0, y, z, 0.0], [0.0, 0.0, x, 0.0, y, z]])
