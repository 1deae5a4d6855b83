from __future__ import annotations

import socket
import subprocess
import sys

import pytest

from rcilab.diagnostics.doctor import software


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM])
def test_a_taken_port_is_noted_with_the_way_round_it(kind: socket.SocketKind) -> None:
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        finding = software.check_port("127.0.0.1", taken.getsockname()[1])
    assert finding.verdict == "note"
    assert ("TCP" if kind == socket.SOCK_STREAM else "UDP") in finding.value
    assert "--port 0" in finding.advice


def test_a_port_that_was_let_go_is_free() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    assert software.check_port("127.0.0.1", port).verdict == "ok"


def test_an_address_that_is_not_ours_is_bad_and_says_how_to_get_it() -> None:
    finding = software.check_address("192.0.2.1")  # Reserved for documentation: no machine has it.
    assert finding.verdict == "bad"
    assert "ip addr add" in finding.advice


def test_an_old_python_is_bad() -> None:
    finding = software.check_python((3, 10, 9))
    assert finding.verdict == "bad"
    assert finding.value == "3.10.9"
    assert "3.11" in finding.advice


def test_a_new_python_is_good() -> None:
    assert software.check_python((3, 13, 0)).verdict == "ok"


@pytest.mark.parametrize(
    ("bounds", "verdict"), [("", "ok"), (">=1,<99", "ok"), (">=99", "bad"), ("<1", "bad"), (">=1.0.0.0", "ok")]
)
def test_a_package_is_judged_by_its_bounds(bounds: str, verdict: str) -> None:
    assert software.check_package("numpy", bounds).verdict == verdict


def test_a_missing_package_is_bad_unless_it_is_optional() -> None:
    assert software.check_package("no-such-package-at-all", ">=1").verdict == "bad"
    assert software.check_package("no-such-package-at-all", ">=1", optional=True).verdict == "note"


def test_every_runtime_package_of_ours_is_looked_at() -> None:
    names = [finding.name for finding in software.check_packages("rcilab")]
    assert {"numpy", "pin", "ruckig", "mujoco", "viser", "yourdfpy", "meshcat", "jupyterlab"} <= set(names)
    assert "pytest" not in names


def test_no_browser_is_noted() -> None:
    assert software.check_browser(("no-such-browser-at-all",)).verdict == "note"


def test_doctor_needs_nothing_of_the_bench():
    code = "import sys, rcilab.diagnostics.doctor.run_checks; print([m for m in sys.modules if 'bench' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
