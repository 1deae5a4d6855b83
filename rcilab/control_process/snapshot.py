"""The status of the control process as one record in shared memory, written and read as a whole."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from rcilab.control_process.layout import Counter
from rcilab.control_process.status import PHASES, Phase

_RECORD = struct.Struct("<BbBBqIIiddd96s1024s")
_ATTEMPTS = 1000  # The writer needs about 3 us; more failures mean that it ended while writing.


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Status of the control process."""

    phase: Phase = "starting"
    code: str = "starting"
    message: str = ""
    powered: bool | None = None
    is_fifo: bool = False
    memory_locked: bool = False
    inputs: int = -1
    """Levels of the digital inputs when last read, one bit each; -1: not read on this connection."""
    outputs_known: int = 0
    """Digital outputs that were set on this connection, one bit each: a controller does not report them."""
    outputs: int = 0
    """Levels of these outputs, one bit each."""
    awaited: int = -1
    """Number of the digital input that the motion waits for; -1: none."""
    rate_hz: float = 0.0
    motion_time: float | None = None
    motion_duration: float | None = None


def write_snapshot(memory: memoryview, counters: memoryview, snapshot: Snapshot) -> None:
    """Writes a snapshot; the sequence number is odd meanwhile."""
    sequence = counters[Counter.SNAPSHOT] | 1
    counters[Counter.SNAPSHOT] = sequence
    _RECORD.pack_into(
        memory,
        0,
        PHASES.index(snapshot.phase),
        -1 if snapshot.powered is None else snapshot.powered,
        snapshot.is_fifo,
        snapshot.memory_locked,
        snapshot.inputs,
        snapshot.outputs_known,
        snapshot.outputs,
        snapshot.awaited,
        snapshot.rate_hz,
        -1.0 if snapshot.motion_time is None else snapshot.motion_time,
        -1.0 if snapshot.motion_duration is None else snapshot.motion_duration,
        snapshot.code.encode(),
        _encode(snapshot.message, 1024),
    )
    counters[Counter.SNAPSHOT] = sequence + 1


def read_snapshot(memory: memoryview, counters: memoryview) -> Snapshot:
    """Returns the latest complete snapshot."""
    data = b""
    for _ in range(_ATTEMPTS):
        before = counters[Counter.SNAPSHOT]
        data = bytes(memory[: _RECORD.size])
        if before % 2 == 0 and counters[Counter.SNAPSHOT] == before:
            break
    facts = _RECORD.unpack(data)
    phase, powered, is_fifo, locked, inputs, outputs_known, outputs, awaited, *timing, code, message = facts
    rate_hz, time, duration = timing
    return Snapshot(
        phase=PHASES[phase] if phase < len(PHASES) else "starting",
        code=_text(code),
        message=_text(message),
        powered=None if powered < 0 else bool(powered),
        is_fifo=bool(is_fifo),
        memory_locked=bool(locked),
        inputs=inputs,
        outputs_known=outputs_known,
        outputs=outputs,
        awaited=awaited,
        rate_hz=rate_hz,
        motion_time=None if time < 0.0 else time,
        motion_duration=None if duration < 0.0 else duration,
    )


def _encode(text: str, size: int) -> bytes:
    return text.encode()[:size].decode(errors="ignore").encode()


def _text(data: bytes) -> str:
    return data.rstrip(b"\0").decode(errors="replace")
