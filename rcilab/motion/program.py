"""Programs: sequences of waypoints that can be planned, saved and exported as a script.

The script is Python that plans the same motion, prints its report and optionally saves it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.motion.joint import DEFAULT_SPEED
from rcilab.motion.path_import import TOOL_DOWN, load_path
from rcilab.motion.program_file import load_program, program_text, read_program, save_program
from rcilab.motion.waypoint import Waypoint, angles_of, named_value, require_count, require_fit, vector_of
from rcilab.motion.waypoint_types import Floats
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_HEAD = '''"""Plans a program of rcilab and prints the report; `python SCRIPT OUT.npz` also saves the motion."""

import sys

import rcilab
from rcilab import Program, Waypoint

program = Program(
'''

_TAIL = """
model = program.applied_to(rcilab.load_model(program.model))
{resolve}motion = rcilab.plan_program(model, program, law="torque_rate_limited"{free})

if __name__ == "__main__":
    report = rcilab.check(motion, model, box=program.safety_box{cell})
    print(report)
    if len(sys.argv) > 1:
        motion.save(sys.argv[1])
    sys.exit(0 if report.ok else 1)
"""

_RESOLVE = """cell = rcilab.Cell.load("cell.json")  # The cell that has the frames and signals of the waypoints.
program = cell.resolve(program)
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A sequence of waypoints for one model, from one start. `plan_program` plans its motion.

    Raises:
        InvalidValueError: A number is out of range, or the number of angles is not the arm's number of axes.
        ModelError: No model has this name.
    """

    model: str
    """Name of the arm's model, spelled as in the manual."""
    start: Floats
    """Joint angles at the start, n of them, [rad]."""
    waypoints: tuple[Waypoint, ...]
    name: str = ""
    """Name for display."""
    tool: Floats | None = None
    """Pose of the tool in the flange frame, position [m] and wxyz, 7 numbers; None is the tool of the model passed
    to `plan_program`."""
    payload: Floats | None = None
    """The load at the flange: mass [kg], centre of mass in the flange frame [m] and, unless it is a point mass, inertia
    about it in flange axes, row by row [kg m^2]; 4 or 13 numbers. None is the load of the model."""
    box: Floats | None = None
    """The safety box of the tool: edges [m], then the pose of its centre in base, position [m] and wxyz, 10 numbers.
    None is no box."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isprintable():
            raise InvalidValueError("name", described(self.name), "must be text in one line").coded("one_line")
        robot = describe_robot(self.model)
        object.__setattr__(self, "model", robot.name)
        n = len(robot.home)
        object.__setattr__(self, "start", angles_of(self.start, "start", n, robot.name))
        if not isinstance(self.waypoints, Iterable):
            raise InvalidValueError(
                "waypoints", described(self.waypoints), "must be a list; use [Waypoint.line(...), ...]"
            )
        object.__setattr__(self, "waypoints", tuple(self.waypoints))
        require_count(len(self.waypoints))
        for number, waypoint in enumerate(self.waypoints, 1):
            if not isinstance(waypoint, Waypoint):
                raise InvalidValueError(f"waypoint {number}", described(waypoint), "must be a Waypoint")
            try:
                require_fit(waypoint, robot)
            except InvalidValueError as error:
                raise named_value(number, waypoint.type, error) from error
        if self.tool is not None:
            tool = as_vector(self.tool, 7, "tool", "position m, wxyz").tolist()
            object.__setattr__(self, "tool", (*vector_of("tool", tool[:3]), *vector_of("wxyz", tool[3:])))
        if self.payload is not None:
            count = 4 if np.size(self.payload) == 4 else 13
            numbers = as_vector(self.payload, count, "payload", "kg, m, kg m^2").tolist()
            object.__setattr__(self, "payload", tuple(numbers))
            if payload_of(self.payload).mass > robot.rated_payload:
                problem = f"kg is above {robot.rated_payload:g} kg, the payload {robot.name} is rated for"
                raise InvalidValueError("payload", numbers[0], problem)
        if self.box is not None:
            box = as_vector(self.box, 10, "box", "edges m, position m, wxyz").tolist()
            pose = (*vector_of("box position", box[3:6]), *vector_of("box wxyz", box[6:]))
            object.__setattr__(self, "box", (*box[:3], *pose))
            _ = self.safety_box

    @property
    def T_flange_tool(self) -> Pose | None:
        """The tool as a pose."""
        return None if self.tool is None else Pose(self.tool[:3], self.tool[3:])

    @property
    def safety_box(self) -> SafetyBox | None:
        """The safety box."""
        if self.box is None:
            return None
        try:
            return SafetyBox(size=self.box[:3], T_base_box=Pose(self.box[3:6], self.box[6:]))
        except InvalidValueError as error:
            raise InvalidValueError("box", self.box, f"is not valid: {error}") from error

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the frames that waypoints are given in; empty if all are in base."""
        return tuple(dict.fromkeys(waypoint.frame for waypoint in self.waypoints if waypoint.frame is not None))

    @property
    def needs_cell(self) -> bool:
        """Whether only a cell can resolve it: frames, names of signals, jaws, or motions around obstacles."""
        return any(
            waypoint.frame is not None
            or waypoint.type == "free"
            or (waypoint.type == "tool" and waypoint.signal is None)
            or isinstance(waypoint.signal, str)
            for waypoint in self.waypoints
        )

    def resolved(self, frames: Mapping[str, Pose]) -> Program:
        """Returns the program with all waypoints in base; `cell.resolve(program)` also resolves names of signals.

        Args:
            frames: Pose of each frame in base by its name, such as `cell.frame_poses`.

        Raises:
            InvalidValueError: A waypoint is in another frame, or too far away from the base.
        """
        if not isinstance(frames, Mapping):
            raise InvalidValueError("frames", described(frames), "must be poses by name; use cell.frame_poses")
        waypoints: list[Waypoint] = []
        for number, waypoint in enumerate(self.waypoints, 1):
            try:
                waypoints.append(
                    waypoint if waypoint.frame is None else waypoint.in_base(_find(frames, waypoint.frame))
                )
            except InvalidValueError as error:
                raise named_value(number, waypoint.type, error) from error
        return replace(self, waypoints=tuple(waypoints))

    def applied_to(self, model: RobotModel) -> RobotModel:
        """Returns the arm with the tool and the load of this program, each unless it is None."""
        tool, payload = self.T_flange_tool, self.payload
        changed = model if tool is None else model.with_tool(tool)
        return changed if payload is None else changed.with_load(payload_of(payload))

    def to_json(self) -> str:
        """Returns the program as JSON, which `from_json` reads back exactly."""
        return program_text(self)

    @classmethod
    def from_json(cls, text: str | bytes, name: str = "program") -> Program:
        """Returns the program in a JSON text.

        Args:
            text: JSON, bytes in UTF-8.
            name: Name of the text, for errors.

        Raises:
            InvalidValueError: The program is not valid; the message names the line, the key and the remedy.
            VersionMismatchError: It has another version of this format.
        """
        content = text if isinstance(text, bytes) else text.encode(errors="surrogatepass")
        return read_program(content, name, cls)

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the program to a file as JSON.

        Raises:
            InvalidValueError: The file cannot be written.
        """
        save_program(self, file)

    @classmethod
    def load(cls, file: str | PathLike[str]) -> Program:
        """Returns the program in a file.

        Raises:
            InvalidValueError: The file does not exist, or its program is not valid; the message names the line.
            VersionMismatchError: It has another version of this format.
        """
        return load_program(file, cls)

    @classmethod
    def from_path(
        cls, file: str | PathLike[str], model: RobotModel, *, start: ArrayLike | None = None, frame: str | None = None,
        wxyz: ArrayLike = TOOL_DOWN, speed: float = DEFAULT_SPEED, blend: float = 0.0,
    ) -> Program:  # fmt: skip
        """Returns the program along a path: G-code (.nc, .ngc, .gcode, .tap), or positions in a table (.csv).

        The first waypoint is a joint move to the path, all others are lines, arcs and circles. What is ignored, and
        feeds that the arm does not have, are warnings. docs/paths.md has the columns and the words.

        Args:
            file: The file.
            model: The arm, with its tool. A feed becomes its part of `model.limits.cartesian.translation_velocity`.
            start: Joint angles at the start of the program, shape (n,), [rad]; None: `model.home`.
            frame: Name of the work frame that the path is given in; None: base.
            wxyz: Orientation of the tool in that frame, a unit quaternion, where the file has none. The default is a
                tool along -z.
            speed: Part of the limits for moves without a feed.
            blend: Radius around the corners, up to 1, [m]; less where half of a neighbouring move is shorter.

        Raises:
            InvalidValueError: The file does not exist, or its path is not valid; the message names the line.
        """
        path = load_path(file, model, frame=frame, wxyz=wxyz, speed=speed, blend=blend)
        for note in path.notes:
            warnings.warn(note, stacklevel=2)
        q = model.home if start is None else as_vector(start, model.n, "start", "rad")
        return cls(
            model=model.name, start=tuple(q.tolist()), waypoints=path.waypoints, name=Path(fspath(file)).stem
        )  # fmt: skip

    def to_python(self) -> str:
        """Returns a script that plans the same motion; `python SCRIPT [OUT.npz]` prints its report.

        If waypoints are in frames, the script takes them from the cell in cell.json, and checks with it.
        """
        return program_script(self)

    def __repr__(self) -> str:
        types = [waypoint.type for waypoint in self.waypoints]
        counts = ", ".join(f"{types.count(kind)} {kind}" for kind in dict.fromkeys(types))
        return f"<Program{f' {self.name!r}' if self.name else ''} for {self.model}: {counts}>"


def payload_of(payload: Floats) -> Payload:
    """Returns the load of a program as a rigid body; see `Program.payload`."""
    inertia = np.zeros((3, 3)) if len(payload) == 4 else np.reshape(payload[4:], (3, 3))
    try:
        return Payload(mass=payload[0], center_of_mass=np.array(payload[1:4]), inertia=inertia)
    except InvalidValueError as error:
        raise InvalidValueError("payload", payload, f"is not valid: {error}") from error


def tool_numbers(tool: Pose) -> Floats:
    """Returns a tool as in `Program.tool`."""
    return (*tool.position.tolist(), *tool.wxyz.tolist())


def payload_numbers(load: Payload) -> Floats:
    """Returns a load as in `Program.payload`, 13 numbers."""
    return (load.mass, *load.center_of_mass.tolist(), *load.inertia.ravel().tolist())


def box_numbers(box: SafetyBox) -> Floats:
    """Returns a safety box as in `Program.box`."""
    return (*box.size, *box.T_base_box.position.tolist(), *box.T_base_box.wxyz.tolist())


def program_script(program: Program) -> str:
    """Returns the script; numbers are exact, and text of the program appears only in string literals."""
    head = [("name", program.name), ("model", program.model), ("tool", program.tool)]
    head += [("payload", program.payload), ("box", program.box), ("start", program.start)]
    lines = [f"    {key}={value!a},\n" for key, value in head if value not in (None, "")]
    waypoints = "".join(f"        {_call(waypoint)},\n" for waypoint in program.waypoints)
    is_free = any(waypoint.type == "free" for waypoint in program.waypoints)
    free = ", free=partial(rcilab.plan_free, cell=cell)" if is_free else ""
    resolve, cell = (_RESOLVE, ", cell=cell") if program.needs_cell else ("", "")
    tail = _TAIL.format(resolve=resolve, cell=cell, free=free)
    head_text = _HEAD.replace("import sys\n", "import sys\nfrom functools import partial\n") if free else _HEAD
    return head_text + "".join(lines) + f"    waypoints=(\n{waypoints}    ),\n)\n" + tail


def _find(frames: Mapping[str, Pose], name: str) -> Pose:
    if name in frames:
        return frames[name]
    known = ", ".join(frames)
    error = InvalidValueError("frame", name, f"does not exist; there are: {known or 'none'}")
    raise error.coded("no_frame", frame=name, known=known or "–")


def _call(waypoint: Waypoint) -> str:
    given = [(field.name, getattr(waypoint, field.name), field.default) for field in fields(waypoint)]
    return "Waypoint(" + ", ".join(f"{key}={value!r}" for key, value, default in given if value != default) + ")"
