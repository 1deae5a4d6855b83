"""Cells as JSON: one entry a line, errors that name the line. Schema: cell.schema.json.

Meshes are files of their own: a JSON file names them relative to itself, a ZIP archive contains them, too.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from rcilab.cell.entries import WORLD, Frame, Obstacle, Signal
from rcilab.cell.shapes import SHAPES, MeshShape, Plane, Shape, Solid, shape_name
from rcilab.cell.tool import Jaws, Part, Tool
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.motion.json_fields import (
    located,
    location,
    read_list,
    read_number,
    read_object,
    read_text,
    read_vector,
)
from rcilab.motion.located_json import Node, read_json

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell

T = TypeVar("T")

MeshNames: TypeAlias = Callable[[MeshShape], tuple[str, float]]
"""Returns the file of a mesh, and the factor on its lengths."""
MeshSource: TypeAlias = Callable[[str, float], MeshShape]
"""Returns the mesh of a file with a factor on its lengths."""

FORMAT = "rcilab cell"
VERSION = 1
_DIGITS = 12  # After the point, of lengths and quaternions.

_KEYS = (
    "format", "version", "name", "model", "base", "floor", "tool", "obstacles", "frames", "workpiece", "parts", "held",
    "signals",
)  # fmt: skip
_POSE = ("position", "wxyz")
_MASS = ("mass", "center_of_mass", "inertia")
_SHAPE = ("shape", "size", "radius", "length", "file", "scale")
_OF_SHAPE = {
    "box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",), "plane": (), "mesh": ("file", "scale"),
}  # fmt: skip


def cell_text(cell: Cell, name_mesh: MeshNames) -> str:
    """Returns a cell as JSON.

    Args:
        cell: The cell.
        name_mesh: Returns the file of a mesh, and the factor on its lengths.

    Raises:
        InvalidValueError: As of `name_mesh`.
    """
    lines = [f'"format": "{FORMAT}"', f'"version": {VERSION}']
    for key, value in (("name", cell.name), ("model", cell.model)):
        if value:
            lines.append(f"{json.dumps(key)}: {_text(value)}")
    if cell.T_world_base is not IDENTITY:
        lines.append(f'"base": {_text(_pose(cell.T_world_base))}')
    lines.append(f'"floor": {_text(cell.floor)}')
    if cell.tool is not None:
        lines.append(f'"tool": {_text(_tool(cell.tool, name_mesh))}')
    lists: tuple[tuple[str, list[dict[str, Any]]], ...] = (
        ("frames", [_frame(frame) for frame in cell.frames]),
        ("obstacles", [_obstacle(obstacle, name_mesh) for obstacle in cell.obstacles]),
        ("parts", [_part(part, name_mesh) for part in cell.parts]),
        ("signals", [{"name": s.name, "kind": s.kind, "channel": s.channel} for s in cell.signals]),
    )
    for key, entries in lists:
        if entries:
            rows = ",\n".join(f"    {_text(entry)}" for entry in entries)
            lines.append(f'"{key}": [\n{rows}\n  ]')
    for key, value in (("workpiece", cell.workpiece), ("held", cell.held)):
        if value:
            lines.append(f"{json.dumps(key)}: {_text(value)}")
    return "{\n" + ",\n".join(f"  {line}" for line in lines) + "\n}\n"


def read_cell(content: bytes, name: str, find_mesh: MeshSource, build: Callable[..., T]) -> T:
    """Returns the cell in a JSON text, built by `build` with the keyword arguments of `Cell`.

    Args:
        content: JSON in UTF-8.
        name: Name of the text, for errors.
        find_mesh: Returns the mesh of a file with a factor on its lengths; raises InvalidValueError without one.
        build: Builds the cell; raises InvalidValueError for an invalid value.

    Raises:
        InvalidValueError: The cell is not valid; the message names line, key, value, bound and remedy.
        VersionMismatchError: It has another version of this format.
    """
    return _Reader(name, find_mesh).read(read_json(content, name), build)


class _Reader:
    """Builds one cell from its JSON. Owned by one call of `read_cell`."""

    def __init__(self, name: str, find_mesh: MeshSource) -> None:
        self._name, self._find_mesh = name, find_mesh

    def read(self, root: Node, build: Callable[..., T]) -> T:
        found = read_object(root, self._name, "a cell", _KEYS, "file_no_cell")
        for key in ("format", "version", "model"):
            if key not in found:
                raise InvalidValueError(
                    f"{self._name}, {key}", None, f'is missing; a cell begins with "format": "{FORMAT}", "version": 1'
                ).coded("file_missing", file=self._name, key=key)
        if found["format"].value != FORMAT:
            raise InvalidValueError(
                location(self._name, found["format"], "format"), found["format"].plain(), f"must be {FORMAT!r}"
            ).coded("file_no_cell", file=self._name, line=found["format"].line)
        if found["version"].value != float(VERSION):
            what = location(self._name, found["version"], "version")
            raise VersionMismatchError(what, found["version"].plain(), VERSION, "the rcilab that wrote it reads it")
        values: dict[str, Any] = {
            key: read_text(self._name, found[key], key)
            for key in ("model", "name", "workpiece", "held")
            if key in found
        }
        if "base" in found:
            entries = read_object(found["base"], self._name, "base", _POSE)
            values["T_world_base"] = self._pose(entries, "base")
        if "floor" in found:
            is_open = found["floor"].value is None
            values["floor"] = None if is_open else read_number(self._name, found["floor"], "floor")
        if "tool" in found:
            values["tool"] = self._tool(found["tool"])
        lists: dict[str, Callable[[Node, str], Any]] = {
            "frames": self._frame,
            "obstacles": self._obstacle,
            "parts": self._part,
            "signals": self._signal,
        }
        for key, read in lists.items():
            if key in found:
                nodes = read_list(self._name, found[key], key)
                values[key] = tuple(read(node, f"{key}, entry {i}") for i, node in enumerate(nodes, 1))
        return self._build(lambda: build(**values), root, found, "")

    def _build(self, build: Callable[[], T], node: Node, found: dict[str, Node], what: str) -> T:
        """Returns what a constructor builds; its error gets the line of the value."""
        try:
            return build()
        except InvalidValueError as error:
            prefix = f"{what}, " if what else ""
            raise located(error, self._name, found.get(error.name.split()[0], node), prefix) from error

    def _frame(self, node: Node, what: str) -> Frame:
        found = read_object(node, self._name, what, ("name", "parent", *_POSE))
        texts = self._texts(found, what, ("name", "parent"))
        pose = self._pose(found, what)
        return self._build(lambda: Frame(T_parent_frame=pose, **texts), node, found, what)

    def _obstacle(self, node: Node, what: str) -> Obstacle:
        found = read_object(node, self._name, what, ("name", "frame", "may_touch", *_SHAPE, *_POSE))
        values: dict[str, Any] = self._texts(found, what, ("name", "frame"))
        if "may_touch" in found:
            touched = read_list(self._name, found["may_touch"], f"{what}, may_touch")
            values["may_touch"] = tuple(read_text(self._name, one, f"{what}, may_touch") for one in touched)
        values |= {"shape": self._shape(node, found, what), "pose": self._pose(found, what)}
        return self._build(lambda: Obstacle(**values), node, found, what)

    def _signal(self, node: Node, what: str) -> Signal:
        found = read_object(node, self._name, what, ("name", "kind", "channel"))
        values: dict[str, Any] = self._texts(found, what, ("name", "kind"))
        if "channel" not in found:
            raise self._missing(node, what, "channel")
        values["channel"] = read_number(self._name, found["channel"], f"{what}, channel")
        return self._build(lambda: Signal(**values), node, found, what)

    def _part(self, node: Node, what: str) -> Part:
        found = read_object(node, self._name, what, ("name", "held_at", "solids", *_MASS))
        values: dict[str, Any] = self._texts(found, what, ("name",)) | self._carried(node, found, what)
        if "held_at" in found:
            entries = read_object(found["held_at"], self._name, f"{what}, held_at", _POSE)
            values["T_tool_part"] = self._pose(entries, what)
        return self._build(lambda: Part(**values), node, found, what)

    def _tool(self, node: Node) -> Tool:
        found = read_object(node, self._name, "tool", ("name", "tcp", "solids", "jaws", *_MASS))
        values: dict[str, Any] = self._texts(found, "tool", ("name",), ()) | self._carried(node, found, "tool")
        if "tcp" in found:
            entries = read_object(found["tcp"], self._name, "tool, tcp", _POSE)
            values["T_flange_tool"] = self._pose(entries, "tool")
        if "jaws" in found:
            values["jaws"] = self._jaws(found["jaws"])
        return self._build(lambda: Tool(**values), node, found, "tool")

    def _jaws(self, node: Node) -> Jaws:
        found = read_object(node, self._name, "jaws", ("open", "closed", "finger", "signal"))
        if "open" not in found:
            raise self._missing(node, "jaws", "open")
        values: dict[str, Any] = {
            key: read_number(self._name, found[key], f"jaws, {key}") for key in ("open", "closed") if key in found
        }
        if "finger" in found:
            values["finger"] = self._solids(found["finger"], "finger")
        if "signal" in found:
            values["signal"] = read_text(self._name, found["signal"], "jaws, signal")
        return self._build(lambda: Jaws(**values), node, found, "jaws")

    def _carried(self, node: Node, found: dict[str, Node], what: str) -> dict[str, Any]:
        values: dict[str, Any] = {}
        mass: dict[str, Any] = {}
        if "mass" in found:
            mass["mass"] = read_number(self._name, found["mass"], f"{what}, mass")
        for key in ("center_of_mass", "inertia"):
            if key in found:
                mass[key] = read_vector(self._name, found[key], f"{what}, {key}")
        if mass:
            values["payload"] = self._build(lambda: Payload(**mass), node, found, what)
        if "solids" in found:
            values["solids"] = self._solids(found["solids"], f"{what}, solids")
        return values

    def _solids(self, node: Node, what: str) -> tuple[Solid, ...]:
        solids: list[Solid] = []
        for number, entry in enumerate(read_list(self._name, node, what), 1):
            name = f"{what} {number}"
            found = read_object(entry, self._name, name, (*_SHAPE, *_POSE))
            solids.append(Solid(shape=self._shape(entry, found, name), pose=self._pose(found, name)))
        return tuple(solids)

    def _shape(self, node: Node, found: dict[str, Node], what: str) -> Shape:
        if "shape" not in found:
            raise self._missing(node, what, "shape")
        kind = read_text(self._name, found["shape"], f"{what}, shape")
        if kind not in SHAPES:
            unknown = InvalidValueError("shape", kind, f"is unknown; known: {', '.join(SHAPES)}")
            raise located(unknown, self._name, found["shape"], f"{what}, ")
        for key in _SHAPE[1:]:
            if key in found and key not in _OF_SHAPE[kind]:
                problem = f"has no meaning for a {kind}; it takes: {', '.join(_OF_SHAPE[kind]) or 'nothing'}"
                raise located(InvalidValueError(key, found[key].plain(), problem), self._name, found[key], f"{what}, ")
        for key in _OF_SHAPE[kind]:
            if key not in found and key != "scale":
                raise self._missing(node, what, key)
        if kind == "plane":
            return Plane()
        if kind == "mesh":
            scale = read_number(self._name, found["scale"], f"{what}, scale") if "scale" in found else 1.0
            file = read_text(self._name, found["file"], f"{what}, file")
            return self._build(lambda: self._find_mesh(file, scale), node, found, what)
        values: dict[str, Any] = {
            key: (read_vector if key == "size" else read_number)(self._name, found[key], f"{what}, {key}")
            for key in _OF_SHAPE[kind]
        }
        return self._build(lambda: SHAPES[kind](**values), node, found, what)

    def _pose(self, found: dict[str, Node], what: str) -> Pose:
        numbers = [
            read_vector(self._name, found[key], f"{what}, {key}") if key in found else default
            for key, default in zip(_POSE, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), strict=True)
        ]
        node = next((found[key] for key in _POSE if key in found), Node(None, 1))
        return self._build(lambda: Pose(*numbers), node, found, what)

    def _texts(
        self, found: dict[str, Node], what: str, keys: Sequence[str], required: Sequence[str] = ("name",)
    ) -> dict[str, Any]:
        for key in required:
            if key not in found:
                raise self._missing(next(iter(found.values()), Node(None, 1)), what, key)
        return {key: read_text(self._name, found[key], f"{what}, {key}") for key in keys if key in found}

    def _missing(self, node: Node, what: str, key: str) -> InvalidValueError:
        return InvalidValueError(location(self._name, node, f"{what}, {key}"), None, "is missing").coded(
            "file_missing", file=self._name, key=key
        )


def _text(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _pose(pose: Pose) -> dict[str, Any]:
    position, wxyz = ([round(x, _DIGITS) + 0.0 for x in part.tolist()] for part in (pose.position, pose.wxyz))
    found: dict[str, Any] = {"position": position}
    if wxyz != [1.0, 0.0, 0.0, 0.0]:
        found["wxyz"] = wxyz
    return found


def _shape(shape: Shape, name_mesh: MeshNames) -> dict[str, Any]:
    kind = shape_name(shape)
    if isinstance(shape, MeshShape):
        file, scale = name_mesh(shape)
        found: dict[str, Any] = {"shape": kind, "file": file}
        return found | ({"scale": scale} if scale != 1.0 else {})
    values = {key: getattr(shape, key) for key in _OF_SHAPE[kind]}
    return {"shape": kind} | {key: list(v) if isinstance(v, tuple) else v for key, v in values.items()}


def _solids(solids: Sequence[Solid], name_mesh: MeshNames) -> list[dict[str, Any]]:
    return [_shape(solid.shape, name_mesh) | _pose(solid.pose) for solid in solids]


def _mass(payload: Payload) -> dict[str, Any]:
    if not payload.mass:
        return {}
    found: dict[str, Any] = {"mass": payload.mass, "center_of_mass": payload.center_of_mass.tolist()}
    return found | ({"inertia": payload.inertia.ravel().tolist()} if payload.inertia.any() else {})


def _tool(tool: Tool, name_mesh: MeshNames) -> dict[str, Any]:
    found: dict[str, Any] = {"name": tool.name, "tcp": _pose(tool.T_flange_tool), **_mass(tool.payload)}
    if tool.solids:
        found["solids"] = _solids(tool.solids, name_mesh)
    if tool.jaws is not None:
        jaws: dict[str, Any] = {"open": tool.jaws.open, "closed": tool.jaws.closed}
        jaws |= {"finger": _solids(tool.jaws.finger, name_mesh)} if tool.jaws.finger else {}
        found["jaws"] = jaws | ({"signal": tool.jaws.signal} if tool.jaws.signal else {})
    return found


def _part(part: Part, name_mesh: MeshNames) -> dict[str, Any]:
    found: dict[str, Any] = {"name": part.name, **_mass(part.payload), "held_at": _pose(part.T_tool_part)}
    return found | ({"solids": _solids(part.solids, name_mesh)} if part.solids else {})


def _frame(frame: Frame) -> dict[str, Any]:
    parent = {} if frame.parent == WORLD else {"parent": frame.parent}
    return {"name": frame.name, **parent, **_pose(frame.T_parent_frame)}


def _obstacle(obstacle: Obstacle, name_mesh: MeshNames) -> dict[str, Any]:
    found: dict[str, Any] = {"name": obstacle.name} | _shape(obstacle.shape, name_mesh) | _pose(obstacle.pose)
    if obstacle.frame != WORLD:
        found["frame"] = obstacle.frame
    return found | ({"may_touch": list(obstacle.may_touch)} if obstacle.may_touch else {})
