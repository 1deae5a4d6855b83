"""The file of a run, `.rcirun`: written while the arm moves, and readable even after a crash of the writer.

The file is a sequence of chunks (`chunks.py`), in this order:

    HEAD    JSON: {"arm": {"name", "tool": 16 numbers row-major, "load": [mass, centre, inertia], and of a calibrated
            arm "calibrated": as in its own file (`model/arm_file.py`)} or null,
            "fields": [[name, numpy type, shape], ...] of one cycle, "bytes": its size,
            "maker": whose faults the bits of "faults" are; the first versions had 32 bits, of Rokae,
            "realtime": false in lock-step, "setup": circumstances (`Setup`),
            "report": the check of the plan, one object per condition, or null}
    PLAN    the planned motion as `Motion.save` writes it; missing for a callback. After a change of the speed override
            a second PLAN follows the cycles, with the motion as executed; the last one is valid
    CELL    the cell that the motion was checked with, as a ZIP archive (`Cell.save`); missing without one
    CYCL    u32 number of cycles, then zlib of their bytes, transposed: the first byte of every cycle, then the second
            byte of every cycle, and so on (adjacent bytes are then similar and compress to a quarter). Any number of
            these chunks
    TAIL    JSON: {"stopped": why the motion ended early or null, "stop_code": its code for other languages or "",
            "truncated": whether the beginning is missing, "paced": whether the speed override was changed during the
            motion}. A file without it is incomplete: after a crash, with a full disk, or because it is still being
            written

All units are SI. A reader ignores chunks of other kinds.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from io import BytesIO
from os import PathLike, fspath
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rcilab.cell.cell import Cell
from rcilab.cell.cell_storage import pack_cell, unpack_cell
from rcilab.core.arrays import described
from rcilab.core.atomic_file import read_limited
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import OTHER_STATE_FIELDS, PLAYOUT_FIELDS, RATE_FIELDS, STATE_FIELDS, cycle_dtype
from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS, require_bytes, require_max_rows, require_rows
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.model.arm_file import arm_facts, build_arm
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion.motion import Motion
from rcilab.recording.chunks import Chunk, decode_chunks, encode_chunk, encode_header, is_damaged
from rcilab.recording.run_setup import Setup

if TYPE_CHECKING:
    from rcilab.conformance.report import Report
    from rcilab.recording.run import Run

R = TypeVar("R")

ENDING = ".rcirun"
CHUNK_CYCLES = 256  # Tuning value: a crash loses at most about a quarter of a second.

_OPTIONAL_FIELDS = {"braking", "command_number", *STATE_FIELDS, *RATE_FIELDS}  # Not recorded by the first versions.
_STOP_CODES = {
    "on request": "on_request",
    "the session was closed while a motion ran": "session_closed",
    "the notebook's page is gone": "page_gone",
    "the kernel was interrupted": "kernel_interrupted",
    "an emergency stop was pressed": "estop",
    "the safety gate was opened": "gstop",
    "the user stop was pressed": "user_stopped",
}
"""Codes of the reasons of a stop, by their sentences: files of earlier versions have only the sentence."""
_ROWS = struct.Struct("<I")
_MAX_TEXT = 4_000_000  # [bytes] Length of HEAD or TAIL. Tuning value: a head with a report has 30 000.
_MIN_CYCLES = 16  # Average of the chunks. Tuning value: all but the last one have `CHUNK_CYCLES`.
_OTHER_CHUNKS = 1000  # Tuning value: a file has up to four other chunks.
_LARGEST_ROW = 4096  # [bytes] Tuning value: a cycle with the complete state takes a third of it.


class RunWriter:
    """Writes a run while the arm moves; the data written so far stay readable after a crash. Owned by one thread.

    Attributes:
        written: Number of cycles that the stream has passed on.

    Args:
        stream: Binary stream; the caller closes it.
        dtype: Layout of one cycle.
        plan: The planned motion; None for a callback.
        model: The arm.
        setup: Circumstances of the run.
        report: The check of the plan.
        realtime: False in lock-step.
        maker: Maker whose faults the bits are; empty: that of the arm.
        cell: The cell that the motion was checked with.
    """

    def __init__(
        self,
        stream: IO[bytes],
        dtype: np.dtype[np.void],
        *,
        plan: Motion | None,
        model: RobotModel | None,
        setup: Setup | None = None,
        report: Report | None = None,
        realtime: bool = True,
        maker: str = "",
        cell: Cell | None = None,
    ) -> None:
        self._stream = stream
        self._dtype = dtype
        self._pending: NDArray[np.void] = np.zeros(0, dtype)
        self.written = 0
        head = {
            "arm": None if model is None else _arm_facts(model),
            "fields": [[name, field[0].base.str, list(field[0].shape)] for name, field in _fields(dtype)],
            "bytes": dtype.itemsize,
            "maker": maker or ("" if model is None else model.description.maker),
            "realtime": realtime,
            "setup": (setup or Setup()).as_dict(),
            "report": None if report is None else report_facts(report),
        }
        stream.write(encode_header() + encode_chunk("HEAD", json.dumps(head).encode()))
        if plan is not None:
            self._write_plan(plan)
        if cell is not None:
            stream.write(encode_chunk("CELL", pack_cell(cell)))
        stream.flush()

    def add(self, cycles: NDArray[np.void]) -> None:
        """Adds cycles; they are written in chunks of `CHUNK_CYCLES`."""
        self._pending = np.concatenate([self._pending, cycles]) if len(self._pending) else cycles
        while len(self._pending) >= CHUNK_CYCLES:
            self._write(self._pending[:CHUNK_CYCLES])
            self._pending = self._pending[CHUNK_CYCLES:]
            self._stream.flush()
            self.written += CHUNK_CYCLES

    def finish(
        self,
        *,
        stopped: str | None = None,
        truncated: bool = False,
        plan: Motion | None = None,
        has_speed_override: bool = False,
    ) -> None:
        """Writes the remaining cycles and the last chunk.

        Args:
            stopped: Why the motion ended early; None if it did not.
            truncated: Whether the beginning is missing.
            plan: The motion as executed, if the speed override was changed during the motion.
            has_speed_override: Whether the plan written at the start already is such a motion.
        """
        if len(self._pending):
            self._write(self._pending)
            self._pending = self._pending[:0]
        if plan is not None:
            self._write_plan(plan)
        tail = {
            "stopped": stopped,
            "stop_code": stopped.code if isinstance(stopped, Remark) else "",
            "truncated": truncated,
            "paced": has_speed_override or plan is not None,
        }
        self._stream.write(encode_chunk("TAIL", json.dumps(tail).encode()))
        self._stream.flush()

    def _write_plan(self, plan: Motion) -> None:
        buffer = BytesIO()
        plan.save(buffer)
        self._stream.write(encode_chunk("PLAN", buffer.getvalue()))

    def _write(self, cycles: NDArray[np.void]) -> None:
        planes = np.frombuffer(cycles.tobytes(), np.uint8).reshape(len(cycles), self._dtype.itemsize).T
        self._stream.write(encode_chunk("CYCL", _ROWS.pack(len(cycles)) + zlib.compress(planes.tobytes(), 1)))


class RunFile:
    """A `.rcirun` file that is written while the arm moves. Owned by one thread.

    Args:
        path: Destination; an existing file is replaced.
        dtype: Layout of one cycle.
        is_new: Whether an existing file is an error.
        facts: `plan`, `model`, `setup`, `report`, `realtime`, `cell` as for `RunWriter`.

    Raises:
        FileExistsError: It exists, and `is_new`.
        InvalidValueError: The file cannot be written. The methods raise it too, and keep a file with cycles only.
    """

    def __init__(self, path: Path, dtype: np.dtype[np.void], *, is_new: bool = False, **facts: Any) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if not is_new:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise _unwritable(path, error) from error
        try:
            self._stream = path.open("xb")  # Not through a link or a named pipe that someone put there meanwhile.
        except OSError as error:
            if is_new and isinstance(error, FileExistsError):
                raise
            raise _unwritable(path, error) from error
        try:
            self._writer = RunWriter(self._stream, dtype, **facts)
        except OSError as error:
            self.discard()
            raise _unwritable(path, error) from error

    def add(self, cycles: NDArray[np.void]) -> None:
        """Adds cycles."""
        try:
            self._writer.add(cycles)
        except OSError as error:
            raise self._abandon(error) from error

    def close(self, *, stopped: str | None = None, truncated: bool = False, plan: Motion | None = None) -> None:
        """Writes the end and closes the file; arguments as for `RunWriter.finish`."""
        try:
            with self._stream:
                self._writer.finish(stopped=stopped, truncated=truncated, plan=plan)
                os.fsync(self._stream.fileno())
        except OSError as error:
            raise self._abandon(error) from error

    def _abandon(self, error: OSError) -> InvalidValueError:
        """Closes the file, deletes it if no cycle is complete in it, and returns the error to raise."""
        if self._writer.written:
            with suppress(OSError):
                self._stream.close()  # Flushes once more, and closes in any case.
        else:
            self.discard()
        return _unwritable(self.path, error)

    def discard(self) -> None:
        """Closes and deletes the file."""
        with suppress(OSError):
            self._stream.close()
        with suppress(OSError):
            self.path.unlink()


def write_run(run: Run, stream: IO[bytes]) -> None:
    """Writes a run."""
    writer = RunWriter(
        stream,
        run.cycles.dtype,
        plan=run.plan,
        model=run.model,
        setup=run.setup,
        report=run.report,
        realtime=run.realtime,
        maker=run.maker,
        cell=run.cell,
    )
    writer.add(run.cycles)
    writer.finish(stopped=run.stopped, truncated=run.truncated, has_speed_override=run.has_speed_override)


def read_run(file: str | PathLike[str], max_rows: int, build: Callable[..., R]) -> R:
    """Reads a `.rcirun` file, of a truncated one everything up to its last complete chunk.

    Args:
        file: Path of the file.
        max_rows: Largest allowed number of cycles.
        build: Builds the run; its keyword arguments are those of `Run`.

    Returns:
        The result of `build`.

    Raises:
        InvalidValueError: The file does not exist, is not a run, is too long, or is damaged at its beginning.
        VersionMismatchError: It was written by another version of this format.
    """
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("run file", described(file), "must be a file name")
    name = fspath(file)
    require_max_rows(max_rows)

    def require_size(size: int) -> None:
        require_bytes(max(size - _MAX_TEXT, 0), max_rows, "run file", name)

    content = read_limited(Path(name), "run file", require_size)
    return decode_content(content, name, max_rows, build)


def decode_content(content: bytes, name: str, max_rows: int, build: Callable[..., R]) -> R:
    """Reads the content of a `.rcirun` file; see `read_run`."""
    chunks = decode_chunks(content, name, max_rows // _MIN_CYCLES + _OTHER_CHUNKS)
    if not chunks or chunks[0].kind != "HEAD":
        raise InvalidValueError("run file", name, "ends before its first cycle; nothing was recorded in it").coded(
            "run_empty", file=name
        )
    require_rows(sum(_count_cycles(chunk) for chunk in chunks), max_rows, "run file", name)
    try:
        return _build(chunks, max_rows, partial(build, is_damaged=is_damaged(content, chunks)))
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        raise InvalidValueError("run file", name, f"is damaged: {error}").coded("run_damaged", file=name) from error
    except (RcilabError, zlib.error, struct.error) as error:
        raise InvalidValueError("run file", name, f"is damaged: {error}").coded("run_damaged", file=name) from error


def report_facts(report: Report) -> list[dict[str, Any]]:
    """Returns a report as JSON data, one object per condition."""
    return [
        {
            "condition": row.id,
            "verdict": row.verdict,
            "value": row.value,
            "bound": row.bound,
            "unit": row.unit,
            "place": row.location,
            "time": row.time,
            "source": row.source,
        }
        for row in report.rows
    ]


def _count_cycles(chunk: Chunk) -> int:
    """Returns the number of cycles in the header of a chunk."""
    return _ROWS.unpack_from(chunk.payload)[0] if chunk.kind == "CYCL" and len(chunk.payload) >= _ROWS.size else 0


def _build(chunks: tuple[Chunk, ...], max_rows: int, build: Callable[..., R]) -> R:
    head = _decode_text(chunks[0])
    dtype = np.dtype([(name, kind, tuple(shape)) for name, kind, shape in head["fields"]])
    if dtype.itemsize != head["bytes"]:
        raise ValueError(f"a cycle takes {head['bytes']} bytes, its fields {dtype.itemsize}")
    if dtype.itemsize > _LARGEST_ROW:
        raise ValueError(f"a cycle takes {dtype.itemsize} bytes, the maximum is {_LARGEST_ROW}")
    _layout_for(dtype)  # Checked before memory for the cycles is allocated.
    cycles = _to_current_layout(_join_cycles([chunk.payload for chunk in chunks if chunk.kind == "CYCL"], dtype))
    cycles.flags.writeable = False
    _require_times(cycles["t"], max(max_rows, DEFAULT_MAX_ROWS))
    plans = [chunk.payload for chunk in chunks if chunk.kind == "PLAN"]
    tails = [chunk for chunk in chunks if chunk.kind == "TAIL"]
    tail = _decode_text(tails[-1]) if tails else {}
    stopped = tail.get("stopped")
    if not isinstance(stopped, str | None):
        raise TypeError("the reason of the stop is not text")
    if stopped is not None:
        code = tail.get("stop_code", _STOP_CODES.get(stopped))
        stopped = Remark(stopped, code if code in _STOP_CODES.values() else "")
    return build(
        plan=Motion.load(BytesIO(plans[-1]), max_rows=max_rows) if plans else None,
        cycles=cycles,
        stopped=stopped,
        truncated=tail.get("truncated", False),
        realtime=head["realtime"],
        model=None if head["arm"] is None else _build_arm(head["arm"]),
        setup=Setup.from_dict(head["setup"]),
        maker=str(head.get("maker", "")),
        cell=next((unpack_cell(chunk.payload, "CELL", Cell) for chunk in chunks if chunk.kind == "CELL"), None),
        has_speed_override=bool(tail.get("paced", len(plans) > 1)),
        is_complete=bool(tails),
    )


def _require_times(t: NDArray[np.float64], most: int) -> None:
    """Requires ascending times that span no more cycles than a motion has.

    Raises:
        ValueError: They are not such.
    """
    if not np.isfinite(t).all() or (np.diff(t) < 0.0).any():
        raise ValueError("its times do not ascend")
    if t.size and t[-1] - t[0] > most * CYCLE_TIME:
        raise ValueError(f"its times span {t[-1] - t[0]:g} s, the maximum is {most * CYCLE_TIME:g} s")


def _decode_text(chunk: Chunk) -> Any:
    """Returns the content of a chunk of JSON.

    Raises:
        ValueError: It is not valid JSON, or too long.
    """
    if len(chunk.payload) > _MAX_TEXT:
        raise ValueError(f"its {chunk.kind} takes {len(chunk.payload)} bytes, the maximum is {_MAX_TEXT}")
    return json.loads(chunk.payload)


def _to_current_layout(cycles: NDArray[np.void]) -> NDArray[np.void]:
    """Converts cycles of a file to the current layout, with 0 or NaN in fields that an earlier version did not record.

    Raises:
        ValueError: A field is missing that every version recorded, or is unknown.
    """
    ours = _layout_for(cycles.dtype)
    if cycles.dtype == ours:
        return cycles
    theirs = _stored_fields(cycles.dtype)
    wide = np.zeros(len(cycles), ours)
    for name in _stored_fields(ours):
        wide[name] = cycles[name] if name in theirs else np.nan if name in (*STATE_FIELDS, *RATE_FIELDS) else 0
    return wide


def _layout_for(dtype: np.dtype[np.void]) -> np.dtype[np.void]:
    """Returns the current layout for cycles of a file.

    Raises:
        ValueError: A field is missing that every version recorded, or is unknown.
    """
    theirs = _stored_fields(dtype)
    if theirs.get("faults") == np.dtype("<u4"):  # Written by the first versions.
        theirs["faults"] = np.dtype("<u8")
    n = theirs["q"].shape[0] if "q" in theirs else 0
    ours = cycle_dtype(
        n,
        complete=any(name in theirs for name in OTHER_STATE_FIELDS),
        playout=any(name in theirs for name in PLAYOUT_FIELDS),
    )
    known = _stored_fields(ours)
    if not theirs.items() <= known.items() or known.keys() - theirs.keys() - _OPTIONAL_FIELDS:
        raise ValueError("its cycles have other fields than this version writes")
    if dtype.itemsize > ours.itemsize:
        raise ValueError(f"a cycle takes {dtype.itemsize} bytes, the maximum with its fields is {ours.itemsize}")
    return ours


def _stored_fields(dtype: np.dtype[np.void]) -> dict[str, np.dtype[Any]]:
    return {name: field[0] for name, field in _fields(dtype) if name != "reserved"}


def _join_cycles(payloads: list[bytes], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Returns the cycles of all chunks; at no time are they in memory twice."""
    cycles = np.zeros(sum(_ROWS.unpack_from(payload)[0] for payload in payloads), dtype)
    end = 0
    for payload in payloads:
        found = _decode_cycles(payload, dtype)
        cycles[end : end + len(found)] = found
        end += len(found)
    return cycles


def _decode_cycles(payload: bytes, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    (rows,) = _ROWS.unpack_from(payload)
    size = rows * dtype.itemsize
    data = zlib.decompressobj().decompress(payload[_ROWS.size :], size + 1)
    planes = np.frombuffer(data, np.uint8).reshape(dtype.itemsize, rows)
    return np.frombuffer(planes.T.tobytes(), dtype)


def _arm_facts(model: RobotModel) -> dict[str, Any]:
    load, description = model.load, model.description
    own = {} if description.nominal is None else {"calibrated": arm_facts(description)}
    return {
        **own,
        "name": model.name,
        "tool": model.T_flange_tool.as_row_major(),
        "load": [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()],
    }


def _build_arm(facts: dict[str, Any]) -> RobotModel:
    mass, center, inertia = facts["load"]
    load = Payload(mass=mass, center_of_mass=np.array(center), inertia=np.array(inertia))
    model = load_model(facts["name"], tool=Pose.from_row_major(facts["tool"]), load=load)
    if "calibrated" not in facts:
        return model
    return RobotModel(build_arm(facts["calibrated"], "the recorded arm"), model.T_flange_tool, load)


def _fields(dtype: np.dtype[np.void]) -> list[tuple[str, Any]]:
    assert dtype.fields is not None
    return list(dtype.fields.items())


def _unwritable(path: Path, error: OSError) -> InvalidValueError:
    return InvalidValueError("run file", str(path), f"cannot be written: {error.strerror}").coded("unwritable")
