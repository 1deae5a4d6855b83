"""A stream may last for hours: what a filter keeps of it does not grow."""

from __future__ import annotations

import math
import pickle
from typing import get_args

import pytest

from rcilab.sim.planner.stream_filter import StreamFilter, StreamMode


@pytest.mark.parametrize("mode", get_args(StreamMode))
def test_a_filter_keeps_no_more_of_a_long_stream_than_of_a_short_one(mode: StreamMode) -> None:
    stream = StreamFilter([0.0] * 6, mode, 0.5)
    sizes: list[int] = []
    for target in range(2000):
        stream.take([math.sin(0.01 * target)] * 6)
        for _ in range(4):
            stream.step()
        if target in (500, 1999):
            sizes.append(len(pickle.dumps(stream)))
    assert sizes[1] < 1.1 * sizes[0]
