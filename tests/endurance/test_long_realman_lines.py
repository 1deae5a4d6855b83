"""Random requests to the virtual RealMan controller, the long version of `test_no_request_breaks_the_controller`."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.makers.realman.controller.bench import Bench
from tests.makers.realman.wire.test_line import FIELDS, commands

pytestmark = pytest.mark.endurance


def test_a_hundred_thousand_random_lines_leave_the_controller_answering():
    rng = np.random.default_rng(7)
    bench, names = Bench(), commands()
    for number in range(100_000):
        fields: dict[str, object] = {}
        for field in rng.choice(FIELDS, rng.integers(0, 6)):
            kind = rng.integers(4)
            fields[str(field)] = (
                int(rng.integers(-(2**33), 2**33)),
                rng.integers(-400000, 400000, rng.integers(0, 8)).tolist(),
                int(rng.integers(0, 3)),
                "x_step",
            )[kind]
        line = json.dumps({"command": str(rng.choice(names)), **fields}).encode()
        if rng.random() < 0.1:
            line = bytes(rng.permutation(np.frombuffer(line, np.uint8)))
        bench.server.receive(bench.peer, line)
        bench.frames.clear()
        if not number % 20:
            bench.run(1)
    bench.ask("get_joint_degree")
