"""The cell of an arm: where it stands, what it carries, what stands around it, and its signals."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import cos
from os import PathLike
from pathlib import Path
from typing import Protocol, TypeVar

from rcilab.cell.cell_storage import load_cell, save_cell
from rcilab.cell.entries import WORLD, Frame, Obstacle, Signal
from rcilab.cell.program_signals import resolve_signals
from rcilab.cell.shapes import LARGEST, Solid
from rcilab.cell.tool import Part, Tool, require_name
from rcilab.core.arrays import as_number, described
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, as_pose
from rcilab.model.dynamics.payload import NO_LOAD, combine_payloads
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.program import Program
from rcilab.robots import describe_robot

MOST = 1000
"""Largest number of obstacles, frames, parts or signals."""
_UPRIGHT = 1.0 - cos(1e-3)
_EXAMPLES = Path(__file__).parent / "examples"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Cell:
    """An arm and what is around it. One value for page, check, simulation and file; poses are in the world frame.

    Raises:
        InvalidValueError: A value is not valid, a name occurs twice, or a frame has no parent.
        ModelError: No model has this name.
    """

    model: str
    """Name of the arm's model, spelled as in the manual."""
    name: str = ""
    """For display, in one line."""
    T_world_base: Pose = IDENTITY
    """Where the arm stands; upright."""
    floor: float | None = 0.0
    """Height of the floor in the world, [m]; None without a floor."""
    tool: Tool | None = None
    obstacles: tuple[Obstacle, ...] = ()
    frames: tuple[Frame, ...] = ()
    workpiece: str = ""
    """Name of the obstacle that is the workpiece; empty without one."""
    parts: tuple[Part, ...] = ()
    """What the tool can hold."""
    held: str = ""
    """Name of the part that the tool holds; empty without one."""
    signals: tuple[Signal, ...] = ()

    def __post_init__(self) -> None:
        """Checks the values."""
        object.__setattr__(self, "model", describe_robot(self.model).name)
        if self.name:
            object.__setattr__(self, "name", require_name(self.name, "cell"))
        object.__setattr__(self, "T_world_base", as_pose(self.T_world_base, "pose of the base"))
        if self.T_world_base.rotation[2, 2] < 1.0 - _UPRIGHT:
            tilt = self.T_world_base.rotation[:, 2].tolist()
            raise InvalidValueError("pose of the base", tilt, "must be upright: its z axis is up, 0 0 1")
        if self.floor is not None:
            height = as_number(self.floor, "floor", "m")
            if not abs(height) <= LARGEST:
                raise InvalidValueError("floor", height, f"must be within {LARGEST:g} m of the world's origin")
            object.__setattr__(self, "floor", height)
        for name, kind in (("obstacles", Obstacle), ("frames", Frame), ("parts", Part), ("signals", Signal)):
            found = getattr(self, name)
            if not isinstance(found, tuple | list) or not all(isinstance(entry, kind) for entry in found):
                raise InvalidValueError(name, described(found), f"must be a list of {kind.__name__}(...)")
            if len(found) > MOST:
                raise InvalidValueError(name, len(found), f"has more than {MOST} entries")
            object.__setattr__(self, name, tuple(found))
            _require_different(name, found)
        self._require_frames()
        for name, chosen, entries in (
            ("workpiece", self.workpiece, self.obstacles),
            ("held", self.held, self.parts),
        ):
            if chosen:
                _find(entries, chosen, name)

    def _require_frames(self) -> None:
        parents = {WORLD: ""}
        for frame in self.frames:
            if frame.name == WORLD:
                raise InvalidValueError("frame name", frame.name, "is that of the cell's own frame; choose another")
            if frame.parent not in parents:
                problem = f"is not a frame above it in the list; there are: {', '.join(parents)}"
                raise InvalidValueError(f"parent of {frame.name}", frame.parent, problem)
            parents[frame.name] = frame.parent
        for obstacle in self.obstacles:
            if obstacle.frame not in parents:
                problem = f"does not exist; there are: {', '.join(parents)}"
                raise InvalidValueError(f"frame of {obstacle.name}", obstacle.frame, problem)

    def T_world(self, frame: str) -> Pose:
        """Returns the pose of a frame in the world.

        Raises:
            InvalidValueError: No frame has this name.
        """
        pose = IDENTITY
        while frame != WORLD:
            found = _find(self.frames, frame, "frame")
            pose, frame = found.T_parent_frame @ pose, found.parent
        return pose

    def T_base(self, frame: str) -> Pose:
        """Returns the pose of a frame in the base frame of the arm.

        Raises:
            InvalidValueError: No frame has this name.
        """
        return self.T_world_base.inverse() @ self.T_world(frame)

    @property
    def frame_poses(self) -> dict[str, Pose]:
        """Pose of each frame in the base frame of the arm by its name, and that of the world."""
        poses = {WORLD: self.T_world_base.inverse()}
        for frame in self.frames:
            poses[frame.name] = poses[frame.parent] @ frame.T_parent_frame
        return poses

    def resolve(self, program: Program) -> Program:
        """Returns a program with its waypoints in base, and with numbers for the names of its signals.

        Raises:
            InvalidValueError: A waypoint is in a frame, or a step has a signal, that the cell does not have, or the
                cell's tool has no jaws or no output for them.
        """
        return resolve_signals(program.resolved(self.frame_poses), self.signals, self.tool)

    def solid(self, name: str) -> Solid:
        """Returns an obstacle as a solid in the base frame of the arm.

        Raises:
            InvalidValueError: No obstacle has this name.
        """
        obstacle = _find(self.obstacles, name, "obstacle")
        return Solid(shape=obstacle.shape, pose=self.T_base(obstacle.frame) @ obstacle.pose)

    @property
    def floor_height(self) -> float | None:
        """Height of the floor in the base frame, [m]; None without a floor."""
        return None if self.floor is None else self.floor - float(self.T_world_base.position[2])

    @property
    def part(self) -> Part | None:
        """The part that the tool holds."""
        return _find(self.parts, self.held, "part") if self.held else None

    def placed(self, obstacle: Obstacle) -> Cell:
        """Returns the cell with an obstacle, in the place of the one with its name if there is one."""
        names = [one.name for one in self.obstacles]
        if obstacle.name not in names:
            return replace(self, obstacles=(*self.obstacles, obstacle))
        at = names.index(obstacle.name)
        return replace(self, obstacles=(*self.obstacles[:at], obstacle, *self.obstacles[at + 1 :]))

    def without(self, name: str) -> Cell:
        """Returns the cell without an obstacle.

        Raises:
            InvalidValueError: No obstacle has this name.
        """
        _find(self.obstacles, name, "obstacle")
        workpiece = "" if name == self.workpiece else self.workpiece
        return replace(self, obstacles=tuple(o for o in self.obstacles if o.name != name), workpiece=workpiece)

    def holding(self, part: str) -> Cell:
        """Returns the cell with a part in the tool; "" for an empty tool.

        Raises:
            InvalidValueError: No part has this name.
        """
        return replace(self, held=part)

    def applied_to(self, model: RobotModel) -> RobotModel:
        """Returns a model with the tool of the cell, and with the load of the tool and the part that it holds.

        Without a tool in the cell, that of the model stays; a held part is then the whole load.

        Raises:
            InvalidValueError: It is another model than that of the cell.
        """
        self.require_arm(model)
        if self.tool is None and self.part is None:
            return model
        T_flange_tool = model.T_flange_tool if self.tool is None else self.tool.T_flange_tool
        load = NO_LOAD if self.tool is None else self.tool.payload
        if self.part is not None:
            load = combine_payloads(load, self.part.at_flange(T_flange_tool)[0])
        return model.with_tool(T_flange_tool).with_load(load)

    def require_arm(self, model: RobotModel) -> None:
        """Requires a model of the cell's arm.

        Raises:
            InvalidValueError: It is another one.
        """
        if require_model(model).name != self.model:
            raise InvalidValueError("cell", self.name or "it", f"is that of {self.model}, the model is {model.name}")

    @property
    def fingerprint(self) -> str:
        """SHA-256 of what a check of a motion depends on, hexadecimal: solids, floor, base, tool and held part."""
        part = self.part
        counted = (
            [(o.name, self.solid(o.name), o.may_touch) for o in self.obstacles],
            self.floor_height,
            None if self.tool is None else (self.tool.T_flange_tool.as_row_major(), self.tool.solids_at()),
            None if part is None else (part.T_tool_part.as_row_major(), part.solids),
        )
        return hashlib.sha256(repr(_plain(counted)).encode()).hexdigest()

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the cell as .json, with the names of the files of its meshes, or as .zip, with the meshes themselves.

        Raises:
            InvalidValueError: The name has another ending, the file cannot be written, or a mesh for .json has no file.
        """
        save_cell(self, file)

    @classmethod
    def load(cls, file: str | PathLike[str]) -> Cell:
        """Returns the cell in a file, .json or .zip.

        Raises:
            InvalidValueError: The file does not exist, or its cell is not valid; the message names the line.
            VersionMismatchError: It has another version of this format.
        """
        return load_cell(file, cls)

    @classmethod
    def example(cls, name: str) -> Cell:
        """Returns one of the cells that come with rcilab: "pick_place", "machine_tending", "polishing".

        Raises:
            InvalidValueError: No example has this name.
        """
        files = {file.stem: file for file in sorted(_EXAMPLES.glob("*.json"))}
        if name not in files:
            raise InvalidValueError("example", described(name), f"is unknown; there are: {', '.join(files)}")
        return cls.load(files[name])

    def __repr__(self) -> str:
        return f"<Cell {self.name or 'of ' + self.model}: {self.model}, {len(self.obstacles)} obstacles>"


def require_cell(cell: object) -> Cell:
    """Returns a cell.

    Raises:
        InvalidValueError: It is something else.
    """
    if isinstance(cell, Cell):
        return cell
    raise InvalidValueError("cell", described(cell), "must be a Cell; use Cell(model=...) or Cell.load(FILE)")


def has_obstacles(cell: Cell | None) -> bool:
    """Returns whether there are obstacles to check."""
    return cell is not None and bool(cell.obstacles)


def required_distance(distance: ClearanceLimit | None, cell: Cell | None) -> ClearanceLimit | None:
    """Returns required distances with the floor of the cell; None if they are not checked."""
    if distance is None or cell is None:
        return distance
    return replace(distance, floor_height=require_cell(cell).floor_height)


class _Named(Protocol):
    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=_Named)


def _find(entries: Iterable[N], name: str, what: str) -> N:
    known: list[str] = []
    for entry in entries:
        if entry.name == name:
            return entry
        known.append(entry.name)
    raise InvalidValueError(what, name, f"does not exist in the cell; there are: {', '.join(known) or 'none'}")


def _require_different(name: str, entries: Iterable[_Named]) -> None:
    seen: set[str] = set()
    for entry in entries:
        if entry.name in seen:
            raise InvalidValueError(name, entry.name, "is the name of two of them; names must differ")
        seen.add(entry.name)


def _plain(value: object) -> object:
    """Returns a value whose text depends on its numbers alone."""
    if isinstance(value, Solid):
        shape = value.shape
        return (type(shape).__name__, getattr(shape, "digest", repr(shape)), _plain(value.pose.as_row_major()))
    if isinstance(value, tuple | list):
        return tuple(_plain(entry) for entry in value)
    return round(value, _DIGITS) + 0.0 if isinstance(value, float) else value


_DIGITS = 9  # After the point, [m]: a cell from its file differs in the last digits of its rotations.
