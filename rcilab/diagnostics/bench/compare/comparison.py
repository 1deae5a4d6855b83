"""All comparisons with other packages."""

from __future__ import annotations

from collections.abc import Iterator

from rcilab.diagnostics.bench.compare.inverse import compare_inverse
from rcilab.diagnostics.bench.compare.timing import compare_timing
from rcilab.diagnostics.bench.measure import Absent, Measurement
from rcilab.model.robot_model import load_model

_ROBOT = "xMatePro7"


def compare() -> Iterator[Measurement | Absent]:
    """Yields one row per task and package, named TASK/PACKAGE; that of a missing package says what to install.

    home: one solution for a random reachable pose, starting at the home pose. near: the same, starting 0.1 rad away in
    every joint. branches: all solutions at 16 arm angles. line: the timing of a straight line. All times are processor
    time of this process, which other load on the machine affects least.
    """
    model = load_model(_ROBOT)
    yield from compare_inverse(model)
    yield from compare_timing(model)
