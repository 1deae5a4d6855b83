"""Programs with the maker's client library against a virtual xArm6: what its official examples do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.makers.ufactory.clients import programs
from tests.makers.ufactory.clients.conftest import PATIENCE, Q6, ROOT, Served

REFUSED = (1, -9)  # By the error, or by the state, whichever the library sees first.


def test_it_reads_every_property(arm: Served) -> None:
    found = arm.run(programs.properties)
    assert found["codes"] == dict.fromkeys(found["codes"], 0)
    assert (found["version"], found["axes"], len(found["serial"])) == ([2, 7, 103], [6, 6], 14)
    np.testing.assert_allclose(found["angles"], Q6, atol=2e-6)
    np.testing.assert_allclose(found["back"], Q6, atol=1e-5)
    np.testing.assert_allclose(found["pose"], found["position"], atol=2e-3)
    np.testing.assert_allclose(found["limits"], [0.1, 1000.0, 1e-4, np.pi, 0.01, 20.0], rtol=1e-6)
    assert (found["volts"], found["warm"]) == (48.0, 30)


def test_no_getter_raises(arm: Served) -> None:
    found = arm.run(programs.getters)
    assert found["raised"] == {}
    assert found["count"] > 70


def test_it_moves_joints_and_waits(arm: Served) -> None:
    found = arm.run(programs.joints)
    assert set(found["codes"]) == {0}
    np.testing.assert_allclose(found["last"], np.add(Q6, 0.24), atol=1e-5)
    np.testing.assert_allclose(found["home"], 0.0, atol=1e-5)


def test_it_moves_lines_arcs_and_circles(arm: Served) -> None:
    found = arm.run(programs.lines)
    assert set(found["codes"]) == {0}
    np.testing.assert_allclose(found["corner"][:3], (300.0, 100.0, 200.0), atol=0.01)
    np.testing.assert_allclose(found["end"][:3], (300.0, 50.0, 230.0), atol=0.01)
    np.testing.assert_allclose(np.abs(found["end"][3:]), (180.0, 0.0, 0.0), atol=0.01)
    np.testing.assert_allclose(found["around"], found["start"], atol=0.01)


def test_it_commands_velocities(arm: Served) -> None:
    found = arm.run(programs.velocities)
    assert set(found["codes"]) == {0}
    np.testing.assert_allclose(found["speeds"][:6], (0.3, 0.0, 0.0, 0.0, 0.0, 0.3), atol=0.05)
    assert -50.0 < found["moved"][2] < -20.0
    np.testing.assert_allclose(found["moved"][:2], 0.0, atol=0.3)


def test_it_changes_targets_on_line(arm: Served) -> None:
    found = arm.run(programs.online)
    assert set(found["codes"]) == {0}
    assert found["joint"] == pytest.approx(0.6, abs=1e-5)
    assert found["off"] == pytest.approx(20.0, abs=0.01)


def test_it_streams_servo_targets(arm: Served) -> None:
    found = arm.run(programs.servo)
    assert found["codes"] == [0]
    assert found["turned"] == pytest.approx(0.149, abs=1e-4)
    np.testing.assert_allclose(found["moved"], (10.0, -24.5), atol=1.0)


@pytest.mark.parametrize(("kind", "rate"), [("rich", 5.0), ("normal", 5.0), ("real", 100.0)])
def test_it_gets_every_kind_of_report(arm: Served, kind: str, rate: float) -> None:
    found = arm.run(programs.reports, kind)
    assert 0.4 * rate < found["rate"] < 1.3 * rate  # By the clock: a busy machine delivers some late.
    assert found["states"][-2:] == [1, 2]
    assert found["angle"] == pytest.approx(found["asked"], abs=1e-5)


def test_it_gets_feedback(arm: Served) -> None:
    found = arm.run(programs.feedback)
    assert set(found["codes"]) == {0}
    motion, output = 23, 134
    assert found["seen"] == [
        [1, motion, 0], [2, motion, 0], [4, output, 0], [1, motion, 0], [2, motion, 0], [1, motion, 0], [2, motion, 2],
    ]  # fmt: skip


def test_it_uses_standard_modbus(arm: Served) -> None:
    found = arm.run(programs.modbus)
    assert found["results"] == [
        0, [0, [1, 0, 0]], 0, [0, [1, 1, 1]], [0, [1, 1, 1]], 0, 0, [0, [5, 6, 7]], 0, [0, [0x35, 6]], [0, [9]],
        [0, [0, 0]], 0x82,
    ]  # fmt: skip
    np.testing.assert_allclose(np.divide(found["angles"], 10.0), found["true"], atol=0.06)


def test_it_uses_signals_and_the_gripper(arm: Served) -> None:
    found = arm.run(programs.signals)
    assert set(found["codes"]) == {0}
    assert [found["digital"][k] for k in (2, 3, 9, 10)] == [1, 1, 1, 0]
    assert found["analog"][0] == pytest.approx(2.5, abs=0.01)
    assert found["tool"] == [1, 0]
    assert found["gripper"] == [0, 400]
    assert found["gripper_version"] == "3.4.3"


def test_it_sets_boundary_load_and_offset(arm: Served) -> None:
    found = arm.run(programs.safety)
    assert found["codes"] == [0] * len(found["codes"])
    assert found["refused"] in REFUSED
    assert found["error"] == 35
    assert found["seen"] == [4, [0.5, [0.0, 0.0, 30.0]], [0.0, 0.0, 100.0, 0.0, 0.0, 0.0]]


def test_it_pauses_stops_and_recovers(arm: Served) -> None:
    found = arm.run(programs.stops)
    assert set(found["codes"]) == {0}
    assert found["paused"] == found["still"]
    assert (found["not_ready"], found["state"]) == (9, 4)
    assert found["unreachable"] in REFUSED
    assert found["error"] in (21, 40)
    assert found["cleaned"] == [0, 0]


def test_two_clients_share_the_arm_and_one_comes_again(arm: Served) -> None:
    found = arm.run(programs.two_clients)
    assert set(found["codes"]) == {0}
    assert found["connected"] == [False, True, True]


_PRIVATE_TEMPORARY_FOLDER = """
exec 9<"$1"; mount -t tmpfs none "$2" && mkdir -p "$1" && mount -c --bind /proc/self/fd/9 "$1" && cd "$1" || exit 77
exec setpriv --bounding-set=-net_bind_service "$3" -m tests.makers.ufactory.clients.unprivileged
"""


def test_an_ordinary_user_needs_no_port(tmp_path: Path) -> None:
    if shutil.which("unshare") is None or shutil.which("setpriv") is None:
        pytest.skip("needs util-linux")
    folder = "/tmp"  # As in the client library.
    if Path(sys.prefix).is_relative_to(folder) and not Path(sys.prefix).is_relative_to(ROOT):
        pytest.skip("the environment is in the temporary folder")
    command = ["unshare", "-m", "sh", "-c", _PRIVATE_TEMPORARY_FOLDER, "sh", str(ROOT), folder, sys.executable]
    environment = {**os.environ, "TMPDIR": "/var/tmp"}  # Which changes nothing.
    found = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if (found.returncode in (1, 77) and "unshare" in found.stderr + found.stdout) or found.returncode == 77:
        pytest.skip("this user may not make a mount namespace")
    assert found.returncode == 0, found.stdout[-2000:] + found.stderr[-2000:]
    assert "TCP port 502 needs privileges: clients on this machine connect by" in found.stderr
