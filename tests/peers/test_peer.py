"""The peer is what it says it is: figures that were sampled from the vendor's library."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.peers.kinematics import rotation, rotation_vector
from tests.peers.robot import Output, low_pass
from tests.peers.s_profile import JointGenerator, path
from tests.peers.wire import pack_command, pack_frame

START, GOAL = (0.0,) * 7, (0.0, math.pi / 6, 0.0, math.pi / 3, 0.0, math.pi / 2, 0.0)


def test_the_joint_generator_is_the_vendors() -> None:
    generator = JointGenerator(0.5, START, GOAL)
    assert generator.duration == pytest.approx(3.2632741228718345, rel=1e-13)
    expected = [0.0, 0.03828572361791123, 0.0, 0.04117387757471215, 0.0, 0.030211609607130294, 0.0]
    assert np.allclose(generator.at(0.3263274122871835), expected, atol=1e-13)
    assert generator.at(10.0) == pytest.approx(GOAL)


def test_the_path_generator_is_the_vendors() -> None:
    axis = path(0.05, 0.2)
    assert axis.duration == pytest.approx(4.6)
    assert axis.at(0.46) == pytest.approx(0.008336648148148145, abs=1e-13)
    assert axis.at(1.38) == pytest.approx(0.054, abs=1e-13)


def test_the_filter_starts_at_the_first_value_and_takes_up_a_fixed_share() -> None:
    first, second = Output(q=(1.0, 2.0)), Output(q=(2.0, 2.0))
    assert low_pass(None, first, 100.0).q == (1.0, 2.0)
    share = 0.001 / (0.001 + 1.0 / (2.0 * math.pi * 100.0))
    assert low_pass(first, second, 100.0).q == pytest.approx((1.0 + share, 2.0))
    assert low_pass(first, second, 1000.0) is second


def test_a_rotation_and_its_vector_are_inverse() -> None:
    vector = np.array([0.3, -0.2, 1.1])
    assert np.allclose(rotation_vector(rotation(vector)), vector, atol=1e-14)


def test_bytes_are_where_the_wire_has_them() -> None:
    assert pack_frame(3, 1, b"\x01").hex() == "000b000000030000000101"
    command = pack_command(0x0102, tuple(float(k) for k in range(7)), psi=0.5, tau=(9.0,) * 7)
    assert len(command) == 290
    assert command[:8].hex() == "0000000000000102"
    assert (command[192], command[201]) == (1, 0)
    assert pack_command(1, psi=0.0)[192] == 0
