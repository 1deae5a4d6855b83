"""A run comes back from its file as it was, and a file that was cut off gives back every whole block."""

from __future__ import annotations

import io
import json
import os
import resource
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import InvalidValueError, UsageError, VersionMismatchError
from rcilab.i18n.translator import Remark, Text
from rcilab.makers.rokae.faults import Fault
from rcilab.recording.chunks import MAGIC, decode_chunks, encode_chunk, encode_header
from rcilab.recording.html_facts import fact_rows
from rcilab.recording.live_recording import LiveRecording, RunFacts
from rcilab.recording.run import Run, build_run, decode_run, load_run
from rcilab.recording.run_file import CHUNK_CYCLES, RunFile, RunWriter, write_run
from rcilab.recording.run_html import run_html
from tests.recording.runs import MODEL, OFFSET, PLAN, SETUP, export_run, some_cycles, some_run


def same(a: Run, b: Run) -> bool:
    return a.cycles.tobytes() == b.cycles.tobytes() and a.cycles.dtype == b.cycles.dtype


def test_a_run_comes_back_as_it_was(tmp_path):
    run = some_run(stopped="on request")
    run.save(tmp_path / "a.rcirun")
    back = rcilab.load_run(tmp_path / "a.rcirun")
    assert same(back, run)
    assert back.plan is not None
    assert np.array_equal(back.plan.q, PLAN.q)
    assert back.model is not None
    assert back.model.fingerprint == MODEL.fingerprint  # Tool and load, too.
    assert (back.setup, back.stopped, back.realtime, back.is_complete) == (SETUP, "on request", True, True)
    assert not back.has_speed_override
    assert back.report is not None
    assert back.report.ok
    assert repr(back) == repr(run)


@pytest.mark.parametrize("is_earlier", [False, True])
def test_the_reason_of_a_stop_comes_back_with_its_code_from_earlier_files_too(is_earlier):
    stop = Remark("an emergency stop was pressed", "estop")
    content = export_run(some_run(stopped=stop), ".rcirun")
    if is_earlier:
        content = without_stop_code(content)
    back = decode_run(content)
    assert (back.stopped, back.is_safety_stop) == (stop, True)
    assert "急停" in run_html(back, "zh")


def without_stop_code(content: bytes) -> bytes:
    """A file as earlier versions wrote it."""
    *head, tail = decode_chunks(content, "earlier", 100)
    facts = json.loads(tail.payload)
    del facts["stop_code"]
    blocks = b"".join(encode_chunk(block.kind, bytes(block.payload)) for block in head)
    return encode_header() + blocks + encode_chunk("TAIL", json.dumps(facts).encode())


def test_a_file_holds_the_plan_that_was_run_in_the_end_and_its_errors_are_right(tmp_path):
    """Another pace makes another plan: the errors against the first one would be those of the pace."""
    path, slower = tmp_path / "a.rcirun", PLAN.slowed(2.0)
    live = LiveRecording(
        RunFacts(plan=slower, model=MODEL, setup=SETUP), RunFile(path, cycle_dtype(7), plan=slower, model=MODEL)
    )
    live.add(some_cycles())
    run = live.finish(plan=PLAN)
    assert run is not None
    rcilab.load_run(path).save(tmp_path / "again.rcirun")
    for kept in (run, rcilab.load_run(path), rcilab.load_run(tmp_path / "again.rcirun")):
        assert kept.has_speed_override
        assert kept.plan is not None
        assert np.array_equal(kept.plan.q, PLAN.q)
        assert kept.tracking is not None
        assert np.abs(kept.tracking.joint).max() == pytest.approx(OFFSET, rel=1e-6)


def test_a_callback_without_plan_or_arm_comes_back_too():
    run = Run(plan=None, cycles=some_cycles(10))
    back = decode_run(export_run(run, ".rcirun"))
    assert same(back, run)
    assert (back.plan, back.model, back.report) == (None, None, None)


def test_a_file_cut_anywhere_opens_up_to_the_last_whole_block(tmp_path):
    run = some_run()
    whole = export_run(run, ".rcirun")
    ends = [at for at, _ in block_places(whole)]
    rows = [0, 0, 0, 0] + [
        min(k * CHUNK_CYCLES, len(run.cycles)) for k in range(1, len(ends))
    ]  # Header, head, plan: none.
    places = sorted({p for end in ends for p in (end - 1, end, end + 1, end + 7)} | set(range(12, len(whole), 9973)))
    for cut in places:
        if cut >= len(whole):
            continue
        if cut < ends[1]:
            with pytest.raises(InvalidValueError, match="ends before its first cycle"):
                decode_run(whole[:cut])
            continue
        back = decode_run(whole[:cut])
        assert not back.is_complete
        kept = rows[sum(end <= cut for end in ends)]
        assert len(back.cycles) == kept
        assert back.cycles.tobytes() == run.cycles[:kept].tobytes()


@pytest.mark.parametrize("cut", [1, 7, 8, 11])
def test_a_file_cut_in_its_header_says_so(cut):
    with pytest.raises(InvalidValueError, match=r"rcilab did not write it|ends before its first cycle"):
        decode_run(export_run(some_run(), ".rcirun")[:cut])


def test_a_spoiled_byte_costs_what_comes_after_it_and_nothing_before():
    run = some_run()
    content = bytearray(export_run(run, ".rcirun"))
    ends = [at for at, _ in block_places(bytes(content))]
    content[ends[3] + 40] ^= 1  # In the second block of cycles.
    back = decode_run(bytes(content))
    assert back.cycles.tobytes() == run.cycles[:CHUNK_CYCLES].tobytes()
    assert not back.is_complete
    assert "the rest of its file is damaged" in repr(back)
    assert ["Ended", "not known: the rest of the file is damaged"] in fact_rows(back, Text("en", "rcilab.recording"))


@pytest.mark.parametrize("length", [1, 100, 20_000])
def test_a_file_with_zeros_in_its_middle_is_damaged_and_a_short_one_is_not(length):
    whole = export_run(some_run(), ".rcirun")
    end = next(at for at, _ in block_places(whole)[3:])
    assert decode_run(whole[:end] + bytes(length) + whole[end + length :]).is_damaged
    assert not decode_run(whole[: end + length]).is_damaged
    assert not decode_run(whole).is_damaged


def test_what_was_written_before_a_crash_is_there(tmp_path):
    path = tmp_path / "runs" / "a.rcirun"
    live = LiveRecording(
        RunFacts(plan=PLAN, model=MODEL, setup=SETUP), RunFile(path, cycle_dtype(7), plan=PLAN, model=MODEL)
    )
    run = some_run()
    for start in range(0, len(run.cycles), 33):
        live.add(run.cycles[start : start + 33])
    crashed = rcilab.load_run(path)  # Nobody has closed it.
    assert len(crashed.cycles) == len(run.cycles) // CHUNK_CYCLES * CHUNK_CYCLES
    assert not crashed.is_complete
    assert "cut off" in repr(crashed)
    ended = live.finish("on request")
    assert ended is not None
    assert same(ended, run)
    back = rcilab.load_run(path)
    assert same(back, run)
    assert (back.is_complete, back.stopped) == (True, "on request")


def test_a_file_from_before_its_cycles_told_of_braking_is_read():
    ours = cycle_dtype(7)
    fields = [(name, field[0].base, field[0].shape) for name, field in ours.fields.items()]
    before = {"faults": ("faults", "<u4"), "braking": ("reserved", "u1", (5,))}
    older = np.dtype([before.get(field[0], field) for field in fields])
    stream, cycles = io.BytesIO(), some_cycles()
    old = np.zeros(len(cycles), older)
    for name in ours.names:
        if name != "braking":
            old[name] = cycles[name]
    writer = RunWriter(stream, older, plan=PLAN, model=MODEL)
    writer.add(old)
    writer.finish()
    back = decode_run(stream.getvalue())
    assert back.cycles.dtype == ours
    assert back.cycles.tobytes() == cycles.tobytes()
    assert back.stop_time is None


def test_other_files_are_refused_in_words(tmp_path):
    for content, words in (
        (b"", "is empty"),
        (b"PK\x03\x04 a zip", "rcilab did not write it"),
        (encode_header() + encode_chunk("HEAD", b"{}"), "is damaged"),
        (encode_header() + encode_chunk("CYCL", b""), "ends before its first cycle"),
    ):
        (tmp_path / "x.rcirun").write_bytes(content)
        with pytest.raises(InvalidValueError, match=words):
            rcilab.load_run(tmp_path / "x.rcirun")
    with pytest.raises(VersionMismatchError, match="99"):
        decode_run(MAGIC + struct.pack("<I", 99))
    with pytest.raises(InvalidValueError, match="does not exist"):
        rcilab.load_run(tmp_path / "nothing.rcirun")
    with pytest.raises(InvalidValueError, match=r"known: \.rcirun, \.csv"):
        some_run().save(tmp_path / "a.xls")
    with pytest.raises(InvalidValueError, match="cannot be written"):
        some_run().save(tmp_path / "no" / "folder.rcirun")


@pytest.mark.parametrize(("size", "kept"), [(1_000, 0), (100_000, CHUNK_CYCLES)])
def test_on_a_full_disk_a_file_is_kept_for_its_complete_cycles_only(tmp_path, size, kept):
    path, limits = tmp_path / "a.rcirun", resource.getrlimit(resource.RLIMIT_FSIZE)
    cycles = some_cycles()[:CHUNK_CYCLES].copy()

    def fill() -> None:
        file = RunFile(path, cycles.dtype, plan=None, model=MODEL)
        while True:
            file.add(cycles)
            cycles["t"] += 1.0

    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))  # Writing fails beyond it, as on a full disk.
    try:
        with pytest.raises(InvalidValueError, match="cannot be written"):
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.exists() == bool(kept)
    if kept:
        assert len(load_run(path).t) >= kept


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UsageError, match=r"Parquet needs pyarrow.*pip install 'rcilab\[export\]'"):
        export_run(some_run(), ".parquet")


def block_places(content: bytes) -> list[tuple[int, bytes]]:
    """Where each block ends, the header first."""
    places, at = [(12, b"")], 12
    while at < len(content):
        kind, length, _ = struct.unpack_from("<4sII", content, at)
        at += 12 + length
        places.append((at, kind))
    return places


def test_what_a_stranger_wrote_into_a_file_is_shown_and_not_run():
    run = replace(some_run(), stopped="<img src=x onerror=alert(1)>")
    assert "<img" not in decode_run(export_run(run, ".rcirun"))._repr_html_()


@pytest.mark.parametrize(
    ("kind", "make", "words"),
    [
        ("TAIL", lambda: b'{"stopped": 7}', "not text"),
        ("TAIL", lambda: b"[1]", "is damaged"),
        ("TAIL", lambda: b"[" * 100_000, "is damaged"),
        ("CYCL", lambda: struct.pack("<I", 4_000_000_000) + zlib.compress(b""), "are more than 1000000"),
        ("CYCL", lambda: struct.pack("<I", 1) + zlib.compress(bytes(50_000_000)), "is damaged"),
    ],
)
def test_a_block_that_lies_is_refused_in_words(kind, make, words):
    """Payloads are made here: every worker collects them, and one runs them."""
    content = export_run(some_run(), ".rcirun")
    head_ends = block_places(content)[1][0]
    with pytest.raises(InvalidValueError, match=words):
        decode_run(content[:head_ends] + encode_chunk(kind, make()))


@pytest.mark.parametrize("delay", [1, 24, 42])
def test_the_delay_of_a_run_that_a_fault_ended_is_found_from_what_came_before_it(delay):
    cycles, fault = some_cycles().copy(), 300
    q = cycles["command"].copy()
    cycles["q_c"][delay:], cycles["q_c"][:delay] = q[:-delay], q[0]
    cycles["q_c"][fault:] = cycles["q_c"][fault - 1]  # From here on the controller brakes by itself.
    cycles["q"] = cycles["q_c"]
    cycles["faults"][fault:] = 1 << Fault.INSTABILITY_DETECTION
    cycles["sent_ns"][fault:] = 0
    run = build_run(cycles, plan=PLAN, model=MODEL)
    assert run.delay == delay
    assert run.largest_error < 1e-9


def test_a_file_with_faults_of_32_bits_is_read_as_before():
    run = rcilab.load_run(Path(__file__).with_name("faults_of_32_bits.rcirun"))  # Written at 0.1, before the change.
    assert run.cycles.dtype == some_cycles().dtype
    assert run.faults == (Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION, Fault.INSTABILITY_DETECTION)
    assert np.flatnonzero(run.cycles["faults"]).tolist() == [9, 10, 11]
    assert run.model is not None
    assert run.model.fingerprint == MODEL.fingerprint
    assert run.stopped == "a fault"
    assert run.is_complete
    for name in ("q", "command", "t", "sent_ns", "lost", "robot_mode"):
        assert run.cycles[name].tobytes() == some_cycles(12)[name].tobytes()


def test_faults_beyond_32_bits_keep_their_number_and_their_maker():
    panda = rcilab.load_model("Panda")
    last = max(panda.description.faults)
    assert last > 31
    cycles = some_cycles(5).copy()
    cycles["faults"][2:] = 1 << int(last)
    for model, maker in ((panda, ""), (None, "franka")):
        stream = io.BytesIO()
        write_run(build_run(cycles, plan=None, model=model, maker=maker), stream)
        assert b'"maker": "franka"' in stream.getvalue()
        assert decode_run(stream.getvalue()).faults == (last,)


def test_what_is_no_file_name_is_said_to_be_none():
    with pytest.raises(InvalidValueError, match="run file must be a file name, got None"):
        rcilab.load_run(None)
    with pytest.raises(InvalidValueError, match="must be a file name, got None"):
        some_run().save(None)


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to(path.with_name("precious"))])
def test_a_run_is_not_written_through_what_someone_has_put_in_its_place(tmp_path, make):
    precious = tmp_path / "precious"
    precious.write_text("mine")
    make(tmp_path / "a.rcirun")
    with RunFile(tmp_path / "a.rcirun", some_run().cycles.dtype, plan=None, model=None)._stream:
        assert (tmp_path / "a.rcirun").is_file()
    assert not (tmp_path / "a.rcirun").is_symlink()
    assert precious.read_text() == "mine"


@pytest.mark.parametrize("last", [np.nan, -1.0, 1e9, 1e300])
def test_times_that_no_motion_has_are_refused(tmp_path, last):
    run = some_run()
    cycles = run.cycles.copy()
    cycles["t"][-1] = last
    replace(run, cycles=cycles).save(tmp_path / "a.rcirun")
    with pytest.raises(InvalidValueError, match="is damaged: its times"):
        load_run(tmp_path / "a.rcirun")


@pytest.mark.parametrize(
    "settings",
    [{"safety_box": 5}, {"safety_box": {"size": [1], "pose": "x", "active": 3}}, {"safety_box": {}}, 5, None],
)
def test_settings_that_are_not_valid_are_refused(tmp_path, settings):
    run = some_run()
    replace(run, setup=replace(run.setup, settings=settings)).save(tmp_path / "a.rcirun")
    with pytest.raises(InvalidValueError, match="is damaged"):
        load_run(tmp_path / "a.rcirun")
