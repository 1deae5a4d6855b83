"""Files that unpack to far more than they are: refused from their headers in one sentence, taken when it is meant."""

from __future__ import annotations

import io
import json
import re
import struct
import subprocess
import sys
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.motion import Motion, Program, Waypoint
from rcilab.recording.chunks import encode_chunk, encode_header
from tests.core.bombs import BOMBS, FAST, packed_zeros
from tests.recording.runs import export_run, some_run

MODEL = rcilab.load_model("xMatePro7")
MEMORY = 1_500_000_000  # [bytes] Address space that a reader gets: the libraries take two thirds of it.


def recording(path: Path) -> Path:
    """9 million cycles, zeros, in a few megabytes."""
    run = some_run()
    fields = [[name, field[0].base.str, list(field[0].shape)] for name, field in run.cycles.dtype.fields.items()]
    size = run.cycles.dtype.itemsize
    head = {"arm": None, "fields": fields, "bytes": size, "realtime": True, "setup": {}, "report": None}
    rows = 900_000
    block = encode_chunk("CYCL", struct.pack("<I", rows) + packed_zeros(size * rows))
    path.write_bytes(encode_header() + encode_chunk("HEAD", json.dumps(head).encode()) + 10 * block)
    return path


def broad(path: Path) -> Path:
    """A million cycles of 4 kB, zeros: what no version has written fills three quarters of each."""
    fields = [[name, field[0].base.str, list(field[0].shape)] for name, field in some_run().cycles.dtype.fields.items()]
    size = some_run().cycles.dtype.itemsize
    fields = [[name, kind, [shape[0] + 4096 - size] if name == "reserved" else shape] for name, kind, shape in fields]
    head = {"arm": None, "fields": fields, "bytes": 4096, "realtime": True, "setup": {}, "report": None}
    rows = 1_000_000
    block = encode_chunk("CYCL", struct.pack("<I", rows) + packed_zeros(4096 * rows))
    path.write_bytes(encode_header() + encode_chunk("HEAD", json.dumps(head).encode()) + block)
    return path


def within(path: Path) -> Path:
    """Coefficients of 0.6 GB, zeros: below what a file may hold, and with a copy above what there is room for."""
    return archive(path, pieces=2_800_000, order=4, breaks=2_800_001)


def unfit(path: Path) -> Path:
    """As many bytes, of which the headers alone say that they do not fit together."""
    return archive(path, pieces=2_800_000, order=4)


def archive(path: Path, pieces: int = 1_300_000, order: int = 18, breaks: int | None = None) -> Path:
    """Coefficients of 1.3 GB, zeros, in a few megabytes."""
    motion = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
    motion.save(path)
    parts = dict(np.load(path))
    if breaks is not None:
        parts["breaks"] = np.zeros(breaks)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=FAST) as file:
        for name, array in parts.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as stream:
                if name == "coefficients":
                    np.lib.format.write_array_header_1_0(
                        stream, {"descr": "<f8", "fortran_order": False, "shape": (pieces, 7, order)}
                    )
                    for _ in range(7 * order):
                        stream.write(bytes(8 * pieces))
                else:
                    np.lib.format.write_array(stream, array)
    return path


def header(path: Path) -> Path:
    """An array that says it has 8 TB, and has none of it."""
    with zipfile.ZipFile(path, "w") as file, file.open("breaks.npy", "w") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    return path


def slow(path: Path) -> Path:
    """A sound motion that takes two months."""
    rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.1).save(path)
    parts = dict(np.load(path))
    np.savez(path, **{**parts, "breaks": 1e7 * parts["breaks"]})
    return path


@pytest.mark.parametrize(
    ("shape", "said"),
    [((127_000_000, 1), "127000000 rows of 1 ms are more than 1000000"), ((2, 60_000_000), "at most 7 joints")],
)
def test_samples_are_refused_from_their_headers(tmp_path: Path, shape: tuple[int, int], said: str):
    """Arrays of 1 GB, as their headers have it: below what a file may hold."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as file, file.open("q.npy", "w") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with pytest.raises(InvalidValueError, match=said):
        Motion.load_samples(tmp_path / "a.npz", rate_hz=1000.0)


def sparse(path: Path) -> Path:
    """Two samples, two hours apart."""
    row = ",".join(f"{angle:.3f}" for angle in MODEL.home)
    path.write_text(f"0,{row}\n7000,{row}\n")
    return path


def wide(path: Path) -> Path:
    """One line of 5 million cells."""
    path.write_text("0," * 5_000_000)
    return path


def tall(path: Path) -> Path:
    """20 million lines."""
    path.write_text("0\n" * 20_000_000)
    return path


CHECK = ("check", "--model", "xMatePro7")


@pytest.mark.parametrize(
    ("make", "name", "command", "said"),
    [
        (
            recording,
            "a.rcirun",
            ("replay", "--no-browser", "--port", "0"),
            "9000000 rows of 1 ms are more than 1000000",
        ),
        (broad, "a.rcirun", ("replay", "--no-browser", "--port", "0"), "a cycle takes 4096 bytes"),
        (within, "a.npz", CHECK, "not enough free memory"),
        (unfit, "a.npz", CHECK, "must have shapes (S + 1,) and (S, n, k)"),
        (archive, "a.npz", CHECK, "MB, unpacked, are more than 1024.0"),
        (header, "a.npz", CHECK, "MB, unpacked, are more than 1024.0"),
        (slow, "a.npz", CHECK, "rows of 1 ms are more than 1000000"),
        (sparse, "a.csv", CHECK, "7000001 rows of 1 ms are more than 1000000"),
        (wide, "a.csv", CHECK, "allowed in a line"),
        (tall, "a.csv", CHECK, "rows of 1 ms are more than 1000000"),
    ],
)
def test_a_bomb_is_refused_in_one_sentence_within_the_memory_of_a_small_machine(
    tmp_path: Path, make: Callable[[Path], Path], name: str, command: tuple[str, ...], said: str
):
    file = make(tmp_path / name)
    limited = f"import resource, runpy, sys; resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, {MEMORY})); "
    start = "sys.argv[0] = 'rcilab'; runpy.run_module('rcilab', run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-c", limited + start, command[0], str(file), *command[1:]],
        capture_output=True, text=True, timeout=120, check=False, env={"OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin"},
    )  # fmt: skip
    assert done.returncode == 2, done.stderr[-2000:]
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(("name", "make", "said"), BOMBS, ids=lambda value: getattr(value, "__name__", ""))
def test_a_bomb_is_refused_before_it_takes_memory(tmp_path: Path, name: str, make: Callable[[Path], None], said: str):
    file = tmp_path / name
    make(file)
    readers = {".rcirun": rcilab.load_run, ".json": Program.load}
    tracemalloc.start()
    try:
        with pytest.raises(InvalidValueError, match=re.escape(said)):
            readers.get(file.suffix, Motion.load)(file)
        assert tracemalloc.get_traced_memory()[1] < 3e8
    finally:
        tracemalloc.stop()


def test_a_motion_of_far_more_pieces_than_rows_is_refused(tmp_path: Path):
    rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.1).save(tmp_path / "a.npz")
    parts = dict(np.load(tmp_path / "a.npz"))
    more = {"breaks": np.zeros(1001), "coefficients": np.zeros((1000, 1, 1)), "goal": [0]}
    np.savez(tmp_path / "a.npz", **{**parts, **more})
    with pytest.raises(InvalidValueError, match="200 rows of 1 ms are more than 100"):
        Motion.load(tmp_path / "a.npz", max_rows=100)


def test_what_is_meant_is_taken(tmp_path: Path):
    motion = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
    for name in ("a.npz", "a.csv"):
        motion.save(tmp_path / name)
        with pytest.raises(InvalidValueError, match=f"max_rows={len(motion)}"):
            Motion.load(tmp_path / name, max_rows=len(motion) - 1)
        assert len(Motion.load(tmp_path / name, max_rows=len(motion))) == len(motion)
    with pytest.raises(InvalidValueError, match="max_rows"):
        Motion.load_samples(tmp_path / "a.csv", max_rows=len(motion) - 1)
    run = some_run()
    (tmp_path / "a.rcirun").write_bytes(export_run(run, ".rcirun"))
    with pytest.raises(InvalidValueError, match=f"--max-rows {len(run.cycles)}"):
        rcilab.load_run(tmp_path / "a.rcirun", max_rows=len(run.cycles) - 1)
    assert len(rcilab.load_run(tmp_path / "a.rcirun", max_rows=max(len(run.cycles), len(run.plan))).cycles) == len(
        run.cycles
    )


def test_a_program_that_takes_hours_is_refused_before_it_is_judged():
    there = (Waypoint.joint(MODEL.home + 0.1, dwell=600.0), Waypoint.joint(MODEL.home, dwell=600.0))
    program = Program(model=MODEL.name, start=MODEL.home, waypoints=there)
    with pytest.raises(PlanningError, match="use fewer rounds or shorter dwells, or pass max_rows=12"):
        rcilab.plan_program(MODEL, program)
    assert rcilab.plan_program(MODEL, program, max_rows=2 * DEFAULT_MAX_ROWS).duration > 1200.0


@pytest.mark.parametrize("bound", [0, -1, 1.5, True, None, "many"])
def test_a_bound_that_is_none_is_refused(bound: object):
    with pytest.raises(InvalidValueError, match="max_rows"):
        Motion.load(io.BytesIO(b""), max_rows=bound)  # type: ignore[arg-type]
