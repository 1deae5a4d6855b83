"""The shared library of LoadModelLibrary, called as a client calls it."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.errors import ModelError
from rcilab.core.spatial import Pose
from rcilab.makers.franka.controller import model_library
from rcilab.makers.franka.controller.model_library import build_model_library, library_source, runs_here
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model

MODEL = load_model("Panda")
RANDOM = np.random.default_rng(3)
ANGLES = RANDOM.uniform(MODEL.limits.joint.lower, MODEL.limits.joint.upper, (10, 7))
TOOL = Pose.from_rpy((0.02, -0.03, 0.1034), (0.1, -0.2, -0.785))
LOAD = Payload(
    mass=1.7,
    center_of_mass=np.array([0.01, -0.02, 0.08]),
    inertia=np.array([[0.004, 1e-4, 2e-4], [1e-4, 0.005, -3e-4], [2e-4, -3e-4, 0.003]]),
)
pytestmark = pytest.mark.skipif(not any(map(shutil.which, model_library.COMPILERS)), reason="no C compiler")


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache") / "rcilab"


@pytest.fixture(scope="module")
def library(cache: Path) -> ctypes.CDLL:
    file = cache.parent / "model.so"
    file.write_bytes(build_model_library(MODEL.description, cache))
    return ctypes.CDLL(str(file))


Call = Callable[..., np.ndarray]


@pytest.fixture(scope="module")
def call(library: ctypes.CDLL) -> Call:
    """Calls a function with arrays and numbers and returns its output of a size, in columns of `rows`."""

    def run(name: str, *args: np.ndarray | float, size: int, rows: int) -> np.ndarray:
        out = np.full(size, np.nan)
        kept = [np.ascontiguousarray(arg) if isinstance(arg, np.ndarray) else arg for arg in args]
        passed = [
            arg.ctypes.data_as(ctypes.c_void_p) if isinstance(arg, np.ndarray) else ctypes.c_double(arg) for arg in kept
        ]
        getattr(library, name)(*passed, out.ctypes.data_as(ctypes.c_void_p))
        return out.reshape(-1, rows).T

    return run


def column_major(T: Pose) -> np.ndarray:
    return T.matrix.T.ravel()


def frame_of(call: Call, number: int, q: np.ndarray) -> np.ndarray:
    return call(f"O_T_J{number}", q, size=16, rows=4)


def test_flange_and_end_effector_are_where_ours_are(call: Call) -> None:
    with_tool = MODEL.with_tool(TOOL)
    for q in ANGLES:
        np.testing.assert_allclose(frame_of(call, 8, q), MODEL.forward(q).matrix, rtol=0.0, atol=1e-12)
        found = call("O_T_J9", q, column_major(TOOL), size=16, rows=4)
        np.testing.assert_allclose(found, with_tool.forward(q).matrix, rtol=0.0, atol=1e-12)


def test_the_frames_of_the_joints_turn_about_their_axes(call: Call) -> None:
    for q in ANGLES:
        J = MODEL.jacobian(q)
        for number in range(1, 8):
            T = frame_of(call, number, q)
            arm = MODEL.forward(q).matrix[:3, 3] - T[:3, 3]
            expected = np.concatenate((np.cross(T[:3, 2], arm), T[:3, 2]))
            np.testing.assert_allclose(expected, J[:, number - 1], rtol=0.0, atol=1e-12)


def test_jacobians_are_ours_in_base_and_in_their_own_axes(call: Call) -> None:
    with_tool, F_T_EE = MODEL.with_tool(TOOL), column_major(TOOL)
    for q in ANGLES:
        for number, model, extra in ((8, MODEL, ()), (9, with_tool, (F_T_EE,))):
            zero = call(f"O_J_J{number}", q, *extra, size=42, rows=6)
            np.testing.assert_allclose(zero, model.jacobian(q), rtol=0.0, atol=1e-12)
            R = model.forward(q).matrix[:3, :3].T
            body = call(f"Ji_J_J{number}", q, *extra, size=42, rows=6)
            np.testing.assert_allclose(body, np.kron(np.eye(2), R) @ zero, rtol=0.0, atol=1e-12)


def test_jacobians_of_the_joints_are_differences_of_their_frames(call: Call) -> None:
    step = 1e-6
    q = ANGLES[0]
    for number in range(1, 8):
        args = () if number == 1 else (q,)
        zero = call(f"O_J_J{number}", *args, size=42, rows=6)
        body = call(f"Ji_J_J{number}", *args, size=42, rows=6)
        for joint in range(7):
            after, before = (frame_of(call, number, q + sign * step * np.eye(7)[joint]) for sign in (1.0, -1.0))
            turn = (after[:3, :3] - before[:3, :3]) @ frame_of(call, number, q)[:3, :3].T / (2.0 * step)
            velocity = (after[:3, 3] - before[:3, 3]) / (2.0 * step)
            expected = [*velocity, turn[2, 1], turn[0, 2], turn[1, 0]]
            np.testing.assert_allclose(zero[:, joint], expected, rtol=0.0, atol=1e-8)
        if number > 1:
            R = frame_of(call, number, q)[:3, :3].T
            np.testing.assert_allclose(body, np.kron(np.eye(2), R) @ zero, rtol=0.0, atol=1e-12)
        else:
            np.testing.assert_allclose(body, zero, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("load", [Payload(), LOAD], ids=["no load", "load"])
def test_dynamics_are_those_of_our_model_with_its_load(call: Call, load: Payload) -> None:
    arm: RobotModel = MODEL.with_load(load)
    body = arm.rigid_body
    numbers = (load.inertia.ravel(), load.mass, load.center_of_mass)
    for q in ANGLES:
        dq = RANDOM.uniform(-2.0, 2.0, 7)
        mass = call("M_NE", q, *numbers, size=49, rows=7)
        np.testing.assert_allclose(mass, body.mass_matrix(q), rtol=0.0, atol=1e-9)
        assert (mass == mass.T).all()
        coriolis = call("c_NE", q, dq, *numbers, size=7, rows=7)[:, 0]
        np.testing.assert_allclose(coriolis, body.motion_torque(q, dq, np.zeros(7)), rtol=0.0, atol=1e-9)
        gravity = call("g_NE", q, np.array([0.0, 0.0, -9.81]), *numbers[1:], size=7, rows=7)[:, 0]
        np.testing.assert_allclose(gravity, body.gravity(q), rtol=0.0, atol=1e-9)


def test_gravity_follows_the_direction_of_a_mounted_arm(call: Call) -> None:
    q = ANGLES[0]
    down = call("g_NE", q, np.array([0.0, 0.0, -9.81]), 0.0, np.zeros(3), size=7, rows=7)
    up = call("g_NE", q, np.array([0.0, 0.0, 9.81]), 0.0, np.zeros(3), size=7, rows=7)
    np.testing.assert_allclose(up, -down, rtol=0.0, atol=1e-12)
    side = call("g_NE", np.zeros(7), np.array([0.0, -9.81, 0.0]), 0.0, np.zeros(3), size=7, rows=7)
    assert abs(side[0, 0]) > 0.1  # Joint 1 carries an arm that is mounted on a wall.


def test_a_library_is_compiled_once(cache: Path, library: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    first = build_model_library(MODEL.description, cache)
    assert first[:4] == b"\x7fELF"
    with pytest.raises(ModelError, match=r"needs a C compiler \(cc, gcc, clang\).*apt install gcc"):
        build_model_library(load_model("FR3").description, cache)


def test_without_a_cache_folder_it_is_compiled_every_time(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert build_model_library(MODEL.description, tmp_path / "file" / "rcilab")[:4] == b"\x7fELF"


def test_a_compiler_that_fails_is_named_with_its_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_library, "library_source", lambda description: "int broken(")
    with pytest.raises(ModelError, match=r"was not compiled by .*: .*error"):
        build_model_library(MODEL.description, tmp_path)


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("exit 0", "no message, and no library"),
        ("exit 1", "no message, and no library"),
        (r"printf '\377\376 bad' >&2; exit 1", "\ufffd\ufffd bad"),
        (
            'for word; do test "$last" = -o && echo text > "$word"; last=$word; done; exit 0',
            "no message, and no library",
        ),
    ],
)
def test_a_compiler_that_writes_no_library_or_no_text_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, message: str
) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f"#!/bin/sh\n{script}\n")
    compiler.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(compiler))
    with pytest.raises(ModelError, match=f"was not compiled by .*/cc: {message}$"):
        build_model_library(MODEL.description, tmp_path / "cache")


def test_without_a_folder_for_temporary_files_it_is_not_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(ModelError, match=r"was not compiled: .*missing"):
        build_model_library(MODEL.description, tmp_path)


@pytest.mark.parametrize("content", [b"", b"\x7fEL", b"no library"])
def test_a_damaged_library_in_the_cache_is_compiled_anew(tmp_path: Path, content: bytes) -> None:
    first = build_model_library(MODEL.description, tmp_path)
    (file,) = tmp_path.glob("*.so")
    file.write_bytes(content)
    assert build_model_library(MODEL.description, tmp_path)[:4] == b"\x7fELF"
    assert len(file.read_bytes()) == len(first)


def test_the_source_has_the_tables_of_the_arm() -> None:
    source = library_source(load_model("FR3").description)
    assert "0.316" in source
    assert "2.9274653454" in source


def test_other_machines_are_refused_by_their_numbers() -> None:
    assert sum(runs_here(architecture, 0) for architecture in range(4)) <= 1
    assert not any(runs_here(architecture, 1) for architecture in range(4))
