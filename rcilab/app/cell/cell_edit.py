"""Edits of a cell: entries added, copied, removed, moved and resized. All poses are in the base frame of the arm."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

from rcilab.app.cell.cell_state import Entry, entries_of
from rcilab.app.goal.goal import POSE_FIELDS, with_pose_field
from rcilab.cell.cell import Cell
from rcilab.cell.entries import WORLD, Frame, Obstacle
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Shape, Sphere
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message

NewKind = Literal["box", "cylinder", "sphere", "plane", "frame"]
SIZE_FIELDS: dict[type[Shape], tuple[str, ...]] = {
    Box: ("size_x", "size_y", "size_z"),
    Cylinder: ("radius", "length"),
    Sphere: ("radius",),
    Plane: (),
    MeshShape: (),
}
"""Names of the lengths of a shape."""
FARTHEST = 10.0
"""[m] Largest coordinate and length of an entry that is edited on the page; more is a mistake of units."""
_NEW: dict[str, Shape] = {
    "box": Box(size=(0.2, 0.2, 0.2)),
    "cylinder": Cylinder(radius=0.05, length=0.3),
    "sphere": Sphere(radius=0.1),
    "plane": Plane(),
}
_BESIDE = (0.5, 0.4)  # [m] Where new entries stand, in the reach of every arm and beside it.
_WALL = 1.0  # [m] Distance of a new wall behind the arm.
_STEP = 0.05  # [m] Distance of a copy.


def pose_of(cell: Cell, entry: Entry) -> Pose:
    """Returns the pose of an entry in its own frame."""
    if entry.kind == "frame":
        return next(frame.T_parent_frame for frame in cell.frames if frame.name == entry.name)
    return obstacle_of(cell, entry).pose


def parent_of(cell: Cell, entry: Entry) -> str:
    """Returns the name of the frame that an entry moves with."""
    if entry.kind == "frame":
        return next(frame.parent for frame in cell.frames if frame.name == entry.name)
    return obstacle_of(cell, entry).frame


def base_pose_of(cell: Cell, entry: Entry) -> Pose:
    """Returns the pose of an entry in the base frame of the arm."""
    return cell.T_base(parent_of(cell, entry)) @ pose_of(cell, entry)


def obstacle_of(cell: Cell, entry: Entry) -> Obstacle:
    """Returns an obstacle."""
    return next(obstacle for obstacle in cell.obstacles if obstacle.name == entry.name)


def added(cell: Cell, kind: NewKind, name: str) -> tuple[Cell, Entry]:
    """Returns a cell with a new entry beside the arm, at the height of its base, and the entry.

    Args:
        cell: The cell.
        kind: What is added.
        name: What its name begins with, in the language of the page.
    """
    entry = Entry("frame" if kind == "frame" else "obstacle", free_name(cell, name))
    if kind == "frame":
        return replace(cell, frames=(*cell.frames, Frame(name=entry.name, T_parent_frame=_beside(cell, 0.0)))), entry
    shape = _NEW[kind]
    pose = (
        Pose((-_WALL, 0.0, 0.0)) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, math.pi / 2.0, 0.0))
        if kind == "plane"
        else None
    )
    return with_shape(cell, entry.name, shape, pose)


def with_shape(cell: Cell, name: str, shape: Shape, T_base: Pose | None = None) -> tuple[Cell, Entry]:
    """Returns a cell with a new obstacle, beside the arm or at a pose in the base frame, and its entry."""
    name = free_name(cell, name)
    pose = _beside(cell, -lowest(shape)) if T_base is None else cell.T_world_base @ T_base
    return cell.placed(Obstacle(name=name, shape=shape, pose=pose)), Entry("obstacle", name)


def lowest(shape: Shape) -> float:
    """Returns the height of the lowest point of a shape in its own frame, [m]."""
    if isinstance(shape, MeshShape):
        return float(shape.vertices[:, 2].min())
    if isinstance(shape, Box):
        return -0.5 * shape.size[2]
    if isinstance(shape, Cylinder):
        return -0.5 * shape.length
    return -shape.radius if isinstance(shape, Sphere) else 0.0


def copied(cell: Cell, entry: Entry) -> tuple[Cell, Entry]:
    """Returns a cell with a copy of an entry next to it, and the copy."""
    name = free_name(cell, entry.name)
    moved = Pose((0.0, _STEP, 0.0)) @ pose_of(cell, entry)
    if entry.kind == "frame":
        frame = Frame(name=name, parent=parent_of(cell, entry), T_parent_frame=moved)
        return replace(cell, frames=(*cell.frames, frame)), Entry("frame", name)
    return cell.placed(replace(obstacle_of(cell, entry), name=name, pose=moved)), Entry("obstacle", name)


def removed(cell: Cell, entry: Entry) -> Cell | Message:
    """Returns the cell without an entry, or what stands in the frame."""
    if entry.kind == "obstacle":
        return cell.without(entry.name)
    inside = [one.name for one in cell.obstacles if one.frame == entry.name]
    inside += [one.name for one in cell.frames if one.parent == entry.name]
    if inside:
        return message("cell.frame_used", name=entry.name, first=inside[0], count=len(inside))
    return replace(cell, frames=tuple(frame for frame in cell.frames if frame.name != entry.name))


def renamed(cell: Cell, entry: Entry, name: str) -> Cell | Message:
    """Returns the cell with another name of an entry; what stands in a frame stays in it."""
    if any(other.name == name and other != entry for other in entries_of(cell)):
        return message("cell.name_taken", name=name)
    if entry.kind == "obstacle":
        obstacles = tuple(replace(o, name=name) if o.name == entry.name else o for o in cell.obstacles)
        return replace(cell, obstacles=obstacles, workpiece=name if cell.workpiece == entry.name else cell.workpiece)
    frames = tuple(
        replace(
            frame,
            name=name if frame.name == entry.name else frame.name,
            parent=name if frame.parent == entry.name else frame.parent,
        )
        for frame in cell.frames
    )
    obstacles = tuple(replace(o, frame=name) if o.frame == entry.name else o for o in cell.obstacles)
    return replace(cell, frames=frames, obstacles=obstacles)


def moved(cell: Cell, entry: Entry, pose: Pose) -> Cell:
    """Returns the cell with an entry at a pose in its own frame."""
    if entry.kind == "frame":
        frames = tuple(replace(f, T_parent_frame=pose) if f.name == entry.name else f for f in cell.frames)
        return replace(cell, frames=frames)
    return cell.placed(replace(obstacle_of(cell, entry), pose=pose))


def moved_in_base(cell: Cell, entry: Entry, pose: Pose) -> Cell:
    """Returns the cell with an entry at a pose in the base frame."""
    return moved(cell, entry, cell.T_base(parent_of(cell, entry)).inverse() @ pose)


def attached(cell: Cell, entry: Entry, frame: str) -> Cell | Message:
    """Returns the cell with an entry that stays where it is and moves with another frame from now on."""
    here = base_pose_of(cell, entry)
    if entry.kind == "frame":
        above, name = [frame], frame
        while name != WORLD:
            name = next(f.parent for f in cell.frames if f.name == name)
            above.append(name)
        if entry.name in above:
            return message("cell.frame_inside", name=entry.name, frame=frame)
        frames = [replace(f, parent=frame) if f.name == entry.name else f for f in cell.frames]
        return moved_in_base(replace(cell, frames=_parents_first(frames)), entry, here)
    return moved_in_base(cell.placed(replace(obstacle_of(cell, entry), frame=frame)), entry, here)


def read_field(cell: Cell, entry: Entry, name: str) -> float | None:
    """Returns a number of an entry, [mm] or [deg]; None if it has no such number."""
    if name in POSE_FIELDS:
        pose, index = pose_of(cell, entry), POSE_FIELDS.index(name)
        return 1000.0 * float(pose.position[index]) if index < 3 else math.degrees(float(pose.rpy[index - 3]))
    if entry.kind == "frame":
        return None
    shape = obstacle_of(cell, entry).shape
    names = SIZE_FIELDS[type(shape)]
    if name not in names:
        return None
    return 1000.0 * (shape.size[names.index(name)] if isinstance(shape, Box) else float(getattr(shape, name)))


def with_field(cell: Cell, entry: Entry, name: str, value: float) -> Cell:
    """Returns the cell with a number of an entry changed; see `read_field`. An obstacle grows upwards only.

    Args:
        cell: The cell.
        entry: An entry that has the number.
        name: Name of the field.
        value: [mm] or [deg]; lengths above 0.
    """
    if name in POSE_FIELDS:
        return moved(cell, entry, with_pose_field(pose_of(cell, entry), name, value))
    obstacle = obstacle_of(cell, entry)
    shape, length = obstacle.shape, value / 1000.0
    if isinstance(shape, Box):
        size = list(shape.size)
        size[SIZE_FIELDS[Box].index(name)] = length
        resized: Shape = replace(shape, size=tuple(size))
    else:
        assert isinstance(shape, Cylinder | Sphere)
        resized = replace(shape, **{name: length})
    lifted = obstacle.pose @ Pose((0.0, 0.0, lowest(shape) - lowest(resized)))
    return cell.placed(replace(obstacle, shape=resized, pose=lifted))


def free_name(cell: Cell, name: str) -> str:
    """Returns a name that no entry has: itself, or with the next number."""
    taken = {entry.name for entry in entries_of(cell)} | {WORLD}
    stem = name.rstrip("0123456789").rstrip() or name
    number = 2
    found = name
    while found in taken:
        found, number = f"{stem} {number}", number + 1
    return found


def _beside(cell: Cell, height: float) -> Pose:
    """Returns a pose in the world beside the arm, upright, at a height above its base; those of several differ."""
    x, y = _BESIDE
    return cell.T_world_base @ Pose((x, y - 0.1 * (len(cell.obstacles) % 8), height))


def _parents_first(frames: list[Frame]) -> tuple[Frame, ...]:
    found: list[Frame] = []
    known = {WORLD}
    while frames:
        frame = next(frame for frame in frames if frame.parent in known)
        frames.remove(frame)
        known.add(frame.name)
        found.append(frame)
    return tuple(found)
