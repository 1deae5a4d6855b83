"""Lines: any bytes give requests, or errors that name what is wrong."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.makers.realman.wire.line import LONGEST_FILE, LONGEST_LINE, LineReader, decode_request, encode_answer
from tests.makers.realman.controller.bench import Bench

LINES = [b'{"command":"movej"}', b'{"command":"get_joint_degree"}', b"{}"]


@given(st.lists(st.integers(1, 60)))
def test_split_and_merged_lines_are_the_same_lines(cuts):
    data, reader, found = b"".join(line + b"\r\n" for line in LINES), LineReader(), []
    while data:
        size = cuts.pop() if cuts else len(data)
        found += reader.feed(data[:size])
        data = data[size:]
    assert found == LINES


def test_a_bare_line_feed_ends_no_line_and_a_line_without_end_is_too_long():
    reader = LineReader()
    assert reader.feed(b'{"command":"a"}\n') == []
    (line,) = reader.feed(b'{"command":"b"}\r\n')
    with pytest.raises(DecodeError, match="JSON is malformed"):
        decode_request(line)
    with pytest.raises(DecodeError, match="CR LF"):
        reader.feed(b"x" * (LONGEST_LINE + 1))


@given(st.lists(st.integers(1, 60)))
def test_an_announced_file_is_one_frame_however_it_is_cut(cuts):
    announced = b'{"command":"run_project","file_size":8}'
    data, reader, found = announced + b"\r\nab\r\ncd\r\n -2{A|" + LINES[0] + b"\r\n", LineReader(), []
    while data:
        size = cuts.pop() if cuts else len(data)
        found += reader.feed(data[:size])
        data = data[size:]
    assert found == [announced, b"ab\r\ncd\r\n", LINES[0]]


def test_a_file_of_an_impossible_size_does_not_follow():
    refused = b'{"command":"run_project","file_size":%d}' % (LONGEST_FILE + 1)
    assert LineReader().feed(refused + b"\r\n" + LINES[0] + b"\r\n") == [refused, LINES[0]]


@pytest.mark.parametrize("line", [b"", b"[]", b"{", b'{"command":1}', b"\xff", b"[" * 50000, b'"command"', b"NaN"])
def test_what_is_no_request_is_a_decode_error(line):
    with pytest.raises(DecodeError):
        decode_request(line)


def test_fields_are_read_with_their_kind_and_number():
    request = decode_request(b'{"command":"x","a":1.0,"b":[1,2],"c":true,"d":"t","e":{"f":2}}')
    assert request.integer("a") == 1
    assert request.integers("b", 2) == (1, 2)
    assert request.flag("c")
    assert request.text("d") == "t"
    assert request.inner("e").integer("f") == 2
    for read in (
        lambda: request.integer("c"),
        lambda: request.integer("missing"),
        lambda: request.integers("b", 3),
        lambda: request.flag("d"),
        lambda: request.text("a"),
        lambda: request.inner("a"),
    ):
        with pytest.raises(InvalidValueError):
            read()


def test_answers_are_compact_and_end_with_cr_lf():
    assert encode_answer({"state": "x", "y": [1, -2], "z": True}) == b'{"state":"x","y":[1,-2],"z":true}\r\n'


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**40), 2**40) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)


def commands() -> list[str]:
    from rcilab.makers.realman.controller.realman_server import GETTERS, SETTERS
    from rcilab.makers.realman.controller.stream_requests import STREAMS

    return sorted({*SETTERS, *GETTERS, *STREAMS})


FIELDS = sorted(
    (
        "joint pose v r trajectory_connect loop offset frame_type joint_step step step_type teach_type direction "
        "teach_joint joint_max_speed joint_min_pos joint_en_state joint_zero_pos joint_clear_err limit_mode frame_name "
        "frame_pose tool_name tool_pose payload position cycle port enable ip custom IO_Num state mode arm_power "
        "id speed trajectory_record voltage_type IO_mode realtime_speed vague_search page_num page_size "
        "arm_line_speed collision_stage radio trajectory_mode follow cartesian_velocity pose_quat"
    ).split()
)


def attack(bench: Bench, data: st.DataObject, count: int) -> None:
    for _ in range(count):
        command = data.draw(st.sampled_from(commands()))
        fields = data.draw(
            st.dictionaries(st.sampled_from(FIELDS), values | st.lists(st.integers(-200, 200)), max_size=5)
        )
        with contextlib.suppress(ValueError):  # NaN and infinity are no JSON.
            line = json.dumps({"command": command, **fields}, allow_nan=False)
            bench.server.receive(bench.peer, line.encode())
        bench.run(2)


@settings(max_examples=10)
@given(st.data())
def test_no_request_breaks_the_controller(data):
    bench = Bench()
    attack(bench, data, 20)
    bench.ask("get_joint_degree")
