"""A run as MCAP: messages with JSON schemas, for Foxglove and PlotJuggler.

Topics, one message per cycle: /measured, /commanded, /plan, /error, /health, /state if the complete state was recorded,
and /tool as a foxglove.PoseInFrame, which Foxglove draws in 3D. A run in a cell has its solids in /cell, as a
foxglove.SceneUpdate in the frames base and flange, and the pose of the flange in /flange. Times are those of the
controller's cycles, counted from the start of the run. The facts of the run are in the metadata record "rcilab".
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from rcilab.core.cycle_log import OTHER_STATE_FIELDS
from rcilab.core.optional_deps import require_library
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.recording.columns import run_facts
from rcilab.recording.foxglove import (
    POSE_SCHEMA,
    SCENE_SCHEMA,
    TRANSFORM_SCHEMA,
    pose_in_frame,
    scene_message,
    transform_message,
)

if TYPE_CHECKING:
    from rcilab.core.arrays import Array
    from rcilab.recording.run import Run

_PROGRESS_INTERVAL = 2000  # Messages between two reports of progress.


@dataclass(frozen=True, slots=True, eq=False)
class _Signal:
    """One entry of a message."""

    name: str
    text: str
    """Meaning and unit, for the schema."""
    values: Array
    """Shape (N,) or (N, n)."""


def write_mcap(run: Run, stream: IO[bytes], progress: Callable[[float], None]) -> None:
    """Writes a run as MCAP.

    Raises:
        UsageError: mcap is not installed.
    """
    writer = require_library("mcap.writer", "MCAP").Writer(stream)
    writer.start(profile="", library="rcilab")
    facts = {key: value if isinstance(value, str) else json.dumps(value) for key, value in run_facts(run).items()}
    writer.add_metadata("rcilab", facts)
    stamps = run.setup.started_ns + np.rint(run.t * 1e9).astype(np.int64)
    topics = {topic: signals for topic, signals in _topics(run).items() if signals}
    channels = {
        topic: _register(writer, topic, f"rcilab.{topic}", _schema(signals)) for topic, signals in topics.items()
    }
    tables = {topic: [(signal.name, signal.values.tolist()) for signal in signals] for topic, signals in topics.items()}
    tool = run.T_base_tool if np.isfinite(run.T_base_tool).all() else None
    if tool is None and run.model is not None:
        tool = run.model.forward_path(run.q)
    tool_channel = None if tool is None else _register(writer, "tool", "foxglove.PoseInFrame", POSE_SCHEMA)
    flange_channel, T_tool_flange = None, IDENTITY
    if run.cell is not None and run.model is not None and len(stamps):
        scene = scene_message(run.cell, run.model.T_flange_tool, int(stamps[0]))
        _write(writer, _register(writer, "cell", "foxglove.SceneUpdate", SCENE_SCHEMA), int(stamps[0]), scene)
        flange_channel = _register(writer, "flange", "foxglove.FrameTransform", TRANSFORM_SCHEMA)
        T_tool_flange = run.model.T_flange_tool.inverse()
    for row, stamp in enumerate(stamps.tolist()):
        for topic, table in tables.items():
            message = {name: _without_nan(values[row]) for name, values in table}
            _write(writer, channels[topic], stamp, message)
        if tool is not None and tool_channel is not None:
            _write(writer, tool_channel, stamp, pose_in_frame(Pose.from_matrix(tool[row]), stamp))
            if flange_channel is not None:
                flange = Pose.from_matrix(tool[row]) @ T_tool_flange
                _write(writer, flange_channel, stamp, transform_message(flange, stamp))
        if row % _PROGRESS_INTERVAL == 0:
            progress(row / len(stamps))
    writer.finish()


def _topics(run: Run) -> dict[str, list[_Signal]]:
    cycles, tracking = run.cycles, run.tracking
    planned = run.planned
    reference = "commanded" if run.plan is None else "planned"
    return {
        "measured": [
            _Signal("q", "measured joint angles, [rad]", run.q),
            _Signal("dq", "measured joint velocities, [rad/s]", run.dq),
            _Signal("tau", "measured joint torques, [N m]", run.tau),
            _Signal("theta", "motor positions, motor side of the gear, [rad]", run.theta),
            _Signal("tau_ext_in_base", "external force and moment, base frame, [N, N m]", run.tau_ext_in_base),
            _Signal(
                "tau_ext_in_stiff", "external force and moment, force-control frame, [N, N m]", run.tau_ext_in_stiff
            ),
        ],
        "commanded": [
            _Signal("q_c", "commanded joint angles as the controller reports them, [rad]", run.q_c),
            _Signal("command", "commanded joint angles as sent, [rad]", run.command),
        ],
        "state": [
            _Signal(name, f"{name} of the robot's state, SI units", cycles[name].reshape(len(cycles), -1))
            for name in OTHER_STATE_FIELDS
            if name in (cycles.dtype.names or ())
        ],
        "plan": [_Signal("q", "planned joint angles, [rad]", planned)] if run.plan is not None else [],
        "error": [
            _Signal("joint", f"measured minus {reference} joint angles, [rad]", tracking.joint),
            _Signal("tool", f"distance of the tool from its {reference} position, [m]", tracking.position),
            _Signal("tool_turn", f"angle of the tool from its {reference} orientation, [rad]", tracking.rotation),
        ],
        "health": [
            _Signal("success_rate", "share of commands that arrived in time, 0 to 1", run.success_rate),
            _Signal("lateness", "delay of the handling of the cycle, [s]", cycles["lateness"]),
            _Signal("lost", "controller cycles lost before this one", cycles["lost"]),
            _Signal("faults", "error bits as one number, bit k is fault k of the manual", cycles["faults"]),
        ],
    }


def _schema(signals: list[_Signal]) -> dict[str, Any]:
    kinds: dict[bool, dict[str, Any]] = {
        False: {"type": "number"},
        True: {"type": "array", "items": {"type": "number"}},
    }
    properties = {s.name: {**kinds[s.values.ndim > 1], "description": s.text} for s in signals}
    return {"type": "object", "properties": properties}


def _register(writer: Any, topic: str, name: str, schema: dict[str, Any]) -> int:
    number = writer.register_schema(name=name, encoding="jsonschema", data=json.dumps(schema).encode())
    return writer.register_channel(topic=f"/{topic}", message_encoding="json", schema_id=number)


def _write(writer: Any, channel: int, stamp: int, message: dict[str, Any]) -> None:
    data = json.dumps(message, separators=(",", ":")).encode()
    writer.add_message(channel_id=channel, log_time=stamp, publish_time=stamp, data=data)


def _without_nan(value: Any) -> Any:
    """Returns a number, or a list of numbers, with None instead of NaN, which JSON does not have."""
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if value != value else value
