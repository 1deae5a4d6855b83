"""World requests and answers survive the wire, and any bytes whatever give a value or a DecodeError."""

from __future__ import annotations

import json
import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.sim import api as world
from rcilab.sim.api import LONGEST_LINE, LineReader, NetworkFaults

share, moment = st.floats(0, 1), st.floats(0.0, 1.0)
FAULTS = st.builds(
    NetworkFaults,
    loss=share,
    delay=moment,
    jitter=moment,
    reorder=share,
    duplicate=share,
    corrupt=share,
    tcp_delay=moment,
    tcp_split=st.integers(0, 100),
    tcp_break=st.none() | st.integers(0, 1000),
    seed=st.integers(0, 2**32 - 1),
)
length, force = st.floats(-10, 10), st.floats(-100, 100)
names = st.text("abcXYZ_-09", min_size=1, max_size=64).filter(lambda name: name.strip("_-"))


def row(item: st.SearchStrategy[float], count: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[item] * count)


TOOLS = st.builds(world.SetTool, row(st.floats(-1, 1), 3), row(st.floats(0.1, 1), 4))
LOADS = st.builds(world.SetLoad, st.floats(0, 10), row(length, 3), row(length, 9))
BOXES = st.builds(world.SetBox, row(length, 3), row(length, 3), row(st.floats(0.1, 1), 4), st.booleans())
SOFT_LIMITS = st.builds(world.SetSoftLimits, row(length, 7), row(length, 7))
REQUESTS = st.one_of(
    st.builds(
        world.Push,
        row(force, 6),
        st.none() | st.integers(1, 7),
        st.none() | row(length, 3),
        st.none() | st.floats(0.001, 100),
        st.floats(0.0, 1.0),
    ),
    st.just(world.Release()),
    st.builds(world.Press, st.sampled_from(["none", "estop", "gstop", "switch"])),
    st.builds(world.Guide, st.booleans()),
    st.builds(world.SetInput, st.integers(0, 5), st.booleans()),
    st.builds(world.LoopBack, st.booleans()),
    st.builds(world.AutoLimit, st.booleans()),
    st.builds(world.Limits, st.sampled_from(["manual", "sdk"])),
    st.builds(world.OnLoss, st.sampled_from(["hold", "bridge"])),
    st.builds(world.Network, FAULTS, st.sampled_from(world.DIRECTIONS)),
    st.builds(world.StallClock, st.just(0.0) | st.floats(0.001, 1), st.floats(0, 100), st.none() | st.floats(10, 100)),
    st.builds(world.PlaceBox, names, row(st.floats(0.001, 1), 3), row(length, 3), row(st.floats(0.1, 1), 4)),
    st.builds(world.RemoveBox, names),
    st.builds(world.Floor, st.booleans()),
    st.builds(world.Walls, st.booleans()),
    st.builds(world.Mount, st.none() | st.floats(0, 10), row(length, 3), row(length, 9)),
    st.builds(world.PlaceArm, row(st.floats(-1, 1), 7)),
    TOOLS,
    LOADS,
    BOXES,
    SOFT_LIMITS,
    st.just(world.GetStatus()),
)
ANSWERS = st.one_of(
    st.just(world.Done()),
    st.builds(world.Refused, st.text()),
    st.builds(
        world.WorldStatus,
        model=st.text(),
        plant=st.text(),
        cycle=st.integers(0, 2**40),
        phase=st.text(),
        faults=st.lists(st.text()).map(tuple),
        reason=st.text(),
        q=st.lists(length, max_size=7).map(tuple),
        success_rate=share,
        missed=st.integers(0, 2**40),
        auto_limit=st.none() | st.booleans(),
        pid=st.integers(0, 2**31),
        record=st.integers(-1, 1000),
        tool=st.none() | TOOLS,
        load=st.none() | LOADS,
        box=st.none() | BOXES,
        soft_limits=st.none() | SOFT_LIMITS,
        inputs=st.none() | st.lists(st.integers(0, 31)).map(tuple),
        commands=FAULTS,
        states=FAULTS,
    ),
)
IDS = st.integers(0, 2**53)


@given(REQUESTS, IDS)
def test_a_request_survives_the_wire(request_: world.WorldRequest, request_id: int) -> None:
    line = world.encode_world_request(request_, request_id)
    assert line.count(b"\n") == 1
    assert world.decode_world_request(line) == (request_id, request_)


@given(ANSWERS, IDS)
def test_an_answer_survives_the_wire(answer: world.WorldAnswer, request_id: int) -> None:
    line = world.encode_world_answer(answer, request_id)
    assert line.count(b"\n") == 1
    assert world.decode_world_answer(line) == (request_id, answer)


def test_readers_of_earlier_releases_understand_the_status_and_theirs_is_understood() -> None:
    status = world.WorldStatus(model="xMatePro7", plant="ideal", cycle=1, phase="idle", auto_limit=True)
    content = json.loads(world.encode_world_answer(status, 1))
    assert "auto_limit" not in content["status"]  # They refuse names in it that they do not know.
    assert content.pop("auto_limit") is True
    _, back = world.decode_world_answer(json.dumps(content).encode())
    assert back == replace(status, auto_limit=None)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


@st.composite
def nearly_requests(draw: st.DrawFn) -> bytes:
    """A right name with right and wrong fields, and any values."""
    kind = world.REQUESTS[draw(st.sampled_from(sorted(world.REQUESTS)))]
    content: dict[str, Any] = {"id": draw(st.just(1) | JSON), "request": kind.name}
    for item in fields(kind):
        content[item.name] = draw(JSON)
    content |= draw(st.dictionaries(st.text(), JSON, max_size=1))
    return json.dumps(content).encode()


@given(st.binary() | JSON.map(lambda value: json.dumps(value).encode()) | nearly_requests())
def test_any_bytes_are_a_value_or_a_decode_error(line: bytes) -> None:
    for decode in (world.decode_world_request, world.decode_world_answer):
        try:
            number, _ = decode(line)
        except DecodeError:
            continue
        assert number >= 0


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"POST / HTTP/1.1\r", "not valid JSON"),
        (b"", "not valid JSON"),
        (b"\xff\xfe", "not valid JSON"),
        (b"[" * 16000, "nested too deeply"),
        (b'{"x":"' + b"a" * 70000 + b'"}', "longer than 65536 bytes"),
        (b"[1]", "not a JSON object"),
        (b'{"request":"explode"}', "unknown request 'explode'; known: push, release, press"),
        (b'{"request":["push"]}', "unknown request"),
        (b'{"request":"push"}', "push needs wrench"),
        (b'{"request":"push","wrench":[0,0,1]}', r"push: wrench needs 6 numbers.*, got \[0, 0, 1\]"),
        (b'{"request":"push","wrench":[0,0,NaN,0,0,0]}', "NaN is not a number"),
        (b'{"request":"push","wrench":[0,0,1e999,0,0,0]}', r"wrench\[2\] must be a finite number.*, got inf"),
        (b'{"request":"push","wrench":[0,0,"1",0,0,0]}', r"wrench\[2\] must be a finite number.*, got '1'"),
        (b'{"request":"push","wrench":[0,0,1e6,0,0,0]}', "needs at most 10000"),
        (b'{"request":"push","wrench":[0,0,1,0,0,0],"limb":4}', "push has no 'limb'; it has: wrench, link, point"),
        (b'{"request":"release","now":true}', "release has no 'now'; it has: nothing"),
        (b'{"request":"press","button":"red"}', "button: 'red' is unknown; known: none, estop, gstop, switch"),
        (b'{"request":"set_input","signal":32,"level":true}', "signal needs a whole number, 0 to 31.*, got 32"),
        (b'{"request":"set_input","signal":1,"level":1}', "level needs true or false.*, got 1"),
        (b'{"request":"network","faults":{"rain":1}}', "known: loss, delay, jitter"),
        (b'{"request":"network","faults":{"loss":2}}', "loss needs 0 to 1.*, got 2"),
        (b'{"request":"network","faults":[]}', "are not faults of a network"),
        (b'{"request":"stall","duration":9}', "duration needs 0 to 5.*, got 9"),
        (b'{"request":"stall","duration":1,"period":0.5}', "period needs 1.001 to.*, got 0.5"),
        (b'{"request":"place_box","box":"a/b","size":[1,1,1],"position":[0,0,0]}', "letters, digits"),
        (b'{"request":"place_box","box":"a","size":[1,1,0],"position":[0,0,0]}', r"size needs 0\.001.*, got 0\.0"),
        (b'{"request":"place_box","box":"a","size":[1,1,1],"position":[0,0,0],"wxyz":[0,0,0,0]}', "no direction"),
        (b'{"request":"release","id":-1}', "id -1 is not a whole number"),
        (b'{"request":"release","id":true}', "id True is not a whole number"),
    ],
)
def test_what_is_no_request_says_why(line: bytes, message: str) -> None:
    try:
        _, request = world.decode_world_request(line)
    except DecodeError as error:
        said = str(error)
    else:
        assert isinstance(request, world.Refused)
        said = request.reason
    assert re.search(message, said)


def test_a_wrong_request_is_refused_by_its_own_id() -> None:
    request_id, answer = world.decode_world_request(b'{"id":7,"request":"press","button":"red"}')
    assert request_id == 7
    assert isinstance(answer, world.Refused)


def test_values_of_numpy_are_values() -> None:
    push = world.Push(np.array([0, 0, -20, 0, 0, 0]), np.int64(4), np.zeros(3), np.float64(0.5))  # type: ignore[arg-type]
    assert push == world.Push((0.0, 0.0, -20.0, 0.0, 0.0, 0.0), 4, (0.0, 0.0, 0.0), 0.5)
    assert world.SetInput(np.int64(2), np.True_) == world.SetInput(2, True)  # type: ignore[arg-type]


def test_a_wrong_value_is_refused_before_it_is_sent() -> None:
    with pytest.raises(InvalidValueError, match="link needs a whole number, 1 to 7, got 0"):
        world.Push((0.0,) * 6, 0)


@given(st.lists(st.binary(max_size=40).filter(lambda line: b"\n" not in line)), st.integers(1, 7))
def test_lines_are_found_however_the_bytes_were_split(lines: list[bytes], size: int) -> None:
    stream = b"".join(line + b"\n" for line in lines)
    reader = LineReader()
    found = [line for start in range(0, len(stream), size) for line in reader.feed(stream[start : start + size])]
    assert found == lines


def test_an_endless_line_is_given_up() -> None:
    reader = LineReader()
    for _ in range(LONGEST_LINE // 4096 - 1):
        assert reader.feed(bytes(4096)) == []
    with pytest.raises(DecodeError, match="longer"):
        reader.feed(bytes(4096))
