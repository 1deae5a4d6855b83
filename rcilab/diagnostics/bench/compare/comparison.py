"""Every comparison in turn."""

from __future__ import annotations

from collections.abc import Iterator

from rcilab.diagnostics.bench.compare.inverse import compare_inverse
from rcilab.diagnostics.bench.compare.timing import compare_timing
from rcilab.diagnostics.bench.measure import Absent, Measurement
from rcilab.model.robot_model import load_model

_ROBOT = "xMatePro7"


def compare() -> Iterator[Measurement | Absent]:
    """Yields a row for every package that can do a task, named TASK/PACKAGE; those not installed say what to install.

    home: one answer to a random reachable pose, asked from the home pose. near: the same with the arm 0.1 rad away in
    every joint. branches: all answers at 16 arm angles. line: the timing of a straight line. All times are processor
    time of this process, so that whatever else runs on the machine burdens the figures least.
    """
    model = load_model(_ROBOT)
    yield from compare_inverse(model)
    yield from compare_timing(model)
