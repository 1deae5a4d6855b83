"""libfranka's filters, against the functions of the libraries: 0.9.2 of panda-python, 0.21 of pylibfranka."""

from __future__ import annotations

import ctypes
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.spatial import Pose
from rcilab.makers.franka.driver.rate_limiter import LOST_CYCLES, LibfrankaFilter
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, plan_joint

MODELS = {5: load_model("Panda"), 10: load_model("FR3")}
CUT_OFFS = [None, 100.0]
_PANDA_VELOCITY = np.array([2.175] * 4 + [2.61] * 3)


class Vector(ctypes.Structure):
    """16 numbers by value."""

    _fields_ = [("values", ctypes.c_double * 16)]


class Library:
    """The functions of a libfranka: arrays are passed by address, a result is written to the first address."""

    def __init__(self, version: int) -> None:
        package, pattern = {5: ("panda_py", "panda_python.libs"), 10: ("pylibfranka", "pylibfranka")}[version]
        found = find_spec(package)
        if found is None or found.origin is None:
            pytest.skip(f"{package} is not installed")
        (path,) = (Path(found.origin).parent.parent / pattern).glob("libfranka*.so.0.*.*")
        self._library = ctypes.CDLL(str(path))
        arrays = {5: 7, 10: 8}[version]
        self._joints = f"_ZN6franka9limitRateERKSt5arrayIdLm7EE{'S3_' * (arrays - 1)}"

    def _call(self, name: str, size: int, *arguments: object) -> np.ndarray:
        result = np.zeros(size)
        arrays = [np.ascontiguousarray(a, dtype=float) if isinstance(a, np.ndarray) else a for a in arguments]
        passed = [ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in arrays]
        function = getattr(self._library, name)
        function.restype = None
        function(ctypes.c_void_p(result.ctypes.data), *passed)
        return result

    def joints(self, *arrays: np.ndarray) -> np.ndarray:
        return self._call(self._joints, 7, *arrays)

    def torques(self, rate: np.ndarray, tau: np.ndarray, last: np.ndarray) -> np.ndarray:
        return self._call("_ZN6franka9limitRateERKSt5arrayIdLm7EES3_S3_", 7, rate, tau, last)

    def pose(self, bounds: list[float], T: np.ndarray, last: np.ndarray, *rates: np.ndarray) -> np.ndarray:
        name = "_ZN6franka9limitRateEddddddRKSt5arrayIdLm16EES3_RKS0_IdLm6EES6_"
        passed = map(ctypes.c_double, bounds)
        return self._call(name, 16, *passed, T.T.ravel(), last.T.ravel(), *rates).reshape(4, 4).T

    def filter(self, u: float, x: float, cut_off: float) -> float:
        function = self._library["_ZN6franka13lowpassFilterEdddd"]
        function.restype = ctypes.c_double
        return function(*map(ctypes.c_double, (0.001, u, x, cut_off)))

    def filter_pose(self, T: np.ndarray, last: np.ndarray, cut_off: float) -> np.ndarray:
        values = [Vector((ctypes.c_double * 16)(*M.T.ravel())) for M in (T, last)]
        name = "_ZN6franka22cartesianLowpassFilterEdSt5arrayIdLm16EES1_d"
        result = self._call(name, 16, ctypes.c_double(0.001), *values, ctypes.c_double(cut_off))
        return result.reshape(4, 4).T


@pytest.fixture(params=sorted(MODELS), ids=lambda version: MODELS[version].name)
def version(request: pytest.FixtureRequest) -> int:
    return request.param


def bounds_at(version: int, q: np.ndarray) -> list[np.ndarray]:
    """Returns upper and lower velocities, accelerations and jerks of rate_limiting.h."""
    if version == 5:
        acceleration = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]) - 1e-3
        jerk = np.array([7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0]) - 1e-3
        return [_PANDA_VELOCITY - 1e-3 - 3e-3 * acceleration, acceleration, jerk]
    most = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
    offset = np.array([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35])
    twice = np.array([12.0, 5.17, 7.0, 8.0, 34.0, 11.0, 34.0])
    joint = MODELS[10].limits.joint
    up, down = (
        np.minimum(most, np.maximum(0.0, np.sqrt(np.maximum(0.0, twice * room)) - offset)) - 1e-3
        for room in (joint.upper - q, q - joint.lower)
    )
    return [up, -down, np.full(7, 10.0 - 1e-3), np.full(7, 5000.0 - 1e-3)]


def jumping(rng: np.random.Generator, lower: np.ndarray, upper: np.ndarray, count: int) -> np.ndarray:
    """Returns rows that jump at times, drift in between, and tremble."""
    goals = rng.uniform(lower, upper, (count // 50 + 2, len(lower)))
    rows = np.repeat(goals, 50, axis=0)[:count]
    shares = (np.arange(count) % 50 / 50.0)[:, np.newaxis]
    return rows + shares * (np.roll(rows, -50, axis=0) - rows) * rng.choice([0.0, 1.0], (count, 1))


@pytest.mark.parametrize("cut_off", CUT_OFFS)
def test_angles_are_limited_as_by_the_library(version: int, cut_off: float | None) -> None:
    library, limits = Library(version), MODELS[version].limits
    stage = LibfrankaFilter(limits, LOST_CYCLES[version], cut_off)
    rng = np.random.default_rng(3)
    wanted = np.clip(jumping(rng, limits.joint.lower, limits.joint.upper, 3000), limits.joint.lower, limits.joint.upper)
    wanted[0] = q = before = second = MODELS[version].home
    stage.begin(JointPosition(q))
    for u in wanted:
        if cut_off is not None:
            u_filtered = np.array([library.filter(a, b, cut_off) for a, b in zip(u, q, strict=True)])
        else:
            u_filtered = u
        velocity, last = (q - before) / 1e-3, (before - second) / 1e-3
        expected = library.joints(*bounds_at(version, q), u_filtered, q, velocity, (velocity - last) / 1e-3)
        sent = stage.step(JointPosition(u))
        assert isinstance(sent, JointPosition)
        assert np.abs(sent.q - expected).max() < 1e-12
        second, before, q = before, q, sent.q
    assert np.abs(q - MODELS[version].home).max() > 0.1


@pytest.mark.parametrize("cut_off", CUT_OFFS)
def test_poses_are_limited_as_by_the_library(version: int, cut_off: float | None) -> None:
    library = Library(version)
    stage = LibfrankaFilter(MODELS[version].limits, LOST_CYCLES[version], cut_off)
    v, a, j, w, dw, ddw = {5: (2.0, 13.0, 6500.0, 2.5, 25.0, 12500.0), 10: (3.0, 9.0, 4500.0, 2.5, 17.0, 8500.0)}[
        version
    ]
    lost = LOST_CYCLES[version] * 1e-3
    bounds = [v - 1e-3 - lost * (a - 1e-3), a - 1e-3, j - 1e-3, w - 1e-3 - lost * (dw - 1e-3), dw - 1e-3, ddw - 1e-3]
    rng = np.random.default_rng(4)
    T = Pose((0.4, 0.0, 0.5)).matrix
    stage.begin(CartesianPosition(T))
    velocity = acceleration = np.zeros(6)
    wanted = T
    for cycle in range(1500):
        if cycle % 60 == 30:
            wanted = Pose.from_rpy(rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.5, 1.5, 3)).matrix
        filtered = wanted if cut_off is None else library.filter_pose(wanted, T, cut_off)
        expected = library.pose(bounds, filtered, T, velocity, acceleration)
        sent = stage.step(CartesianPosition(wanted))
        assert isinstance(sent, CartesianPosition)
        assert np.abs(sent.T_base_tool - expected).max() < 1e-12
        T, before = sent.T_base_tool, velocity
        velocity = np.concatenate([rates.velocity for rates in stage._rates[:2]])
        acceleration = (velocity - before) / 1e-3
    assert np.abs(velocity).max() > 0.1


def test_torques_are_limited_as_by_the_library(version: int) -> None:
    library = Library(version)
    stage = LibfrankaFilter(MODELS[version].limits, LOST_CYCLES[version], 100.0)
    wanted = jumping(np.random.default_rng(5), np.full(7, -20.0), np.full(7, 20.0), 1000)
    stage.begin(JointTorque(wanted[0]))
    tau = np.zeros(7)
    for u in wanted:
        filtered = np.array([library.filter(a, b, 100.0) for a, b in zip(u, tau, strict=True)])
        tau = library.torques(np.full(7, 1000.0 - 1e-3), filtered, tau)
        sent = stage.step(JointTorque(u))
        assert isinstance(sent, JointTorque)
        assert np.abs(sent.tau - tau).max() < 1e-10  # Both go on from their own last torques.
        tau = sent.tau


def streamed(model: RobotModel, wanted: np.ndarray, cut_off: float | None) -> np.ndarray:
    stage = LibfrankaFilter(model.limits, LOST_CYCLES[10 if model.name == "FR3" else 5], cut_off)
    stage.begin(JointPosition(wanted[0]))
    return np.array([stage.step(JointPosition(q)).q for q in wanted])  # type: ignore[union-attr]


def test_a_motion_inside_the_limits_passes_unchanged(version: int) -> None:
    model = MODELS[version]
    q = plan_joint(model, model.home, model.home + 0.3, speed=0.5).q
    assert np.abs(streamed(model, q, None) - q).max() < 1e-12


def test_a_jump_is_overshot_within_the_limits(version: int) -> None:
    model = MODELS[version]
    wanted = np.vstack([model.home] * 2 + [model.home + 0.05] * 6000)
    q = streamed(model, wanted, 100.0)
    share = (q - model.home) / 0.05
    assert (share.max(axis=0) > 1.9).all()
    assert np.abs(share[-500:] - 1.0).max() < 1e-5
    assert not {v.condition.id for v in check(Motion.from_cycles(q), model, distance=None).violations} - {
        "end.velocity"
    }
    assert np.abs((streamed(model, wanted, None) - model.home)[-500:] / 0.05 - 1.0).max() > 1.0  # It swings for ever.


def test_an_elbow_is_limited_like_a_joint() -> None:
    stage = LibfrankaFilter(MODELS[5].limits, LOST_CYCLES[5], None)
    T = Pose((0.4, 0.0, 0.5)).matrix
    stage.begin(CartesianPosition(T, 0.0))
    angles = [stage.step(CartesianPosition(T, 0.5)).psi for _ in range(900)]  # type: ignore[union-attr]
    rates = np.array([0.0, 0.0, 0.0, *angles])
    bounds = 2.175 - 1e-3 - 3e-3 * 9.999, 9.999, 4999.999
    for order, bound in enumerate(bounds, 1):
        reached = np.abs(np.diff(rates, order)).max() / 1e-3**order
        assert reached <= bound * (1.0 + 1e-6)
    assert rates.max() > 0.5
