"""Messages that Foxglove draws: poses, and the solids of a cell. Schemas: https://docs.foxglove.dev/docs/sdk/schemas."""

from __future__ import annotations

from typing import Any

from rcilab.cell.cell import Cell
from rcilab.cell.shape_mesh import carried_solids, shape_mesh
from rcilab.cell.shapes import Box, Cylinder, Solid, Sphere
from rcilab.core.spatial import Pose

_COLORS = {"obstacle": (0.62, 0.66, 0.72, 1.0), "tool": (0.30, 0.33, 0.38, 1.0), "part": (0.90, 0.62, 0.25, 1.0)}


def pose_in_frame(T_base_tool: Pose, stamp: int) -> dict[str, Any]:
    """Returns a foxglove.PoseInFrame; `stamp` in nanoseconds since 1970."""
    return {"timestamp": _time(stamp), "frame_id": "base", "pose": _pose(T_base_tool)}


def transform_message(T_base_flange: Pose, stamp: int) -> dict[str, Any]:
    """Returns a foxglove.FrameTransform of the flange; `stamp` as of `pose_in_frame`."""
    pose = _pose(T_base_flange)
    return {
        "timestamp": _time(stamp),
        "parent_frame_id": "base",
        "child_frame_id": "flange",
        "translation": pose["position"],
        "rotation": pose["orientation"],
    }


def scene_message(cell: Cell, T_flange_tool: Pose, stamp: int) -> dict[str, Any]:
    """Returns the solids of a cell as a foxglove.SceneUpdate.

    Args:
        cell: The cell.
        T_flange_tool: Pose of the tool, of an arm whose cell has no tool.
        stamp: As of `pose_in_frame`.
    """
    entities = [
        _entity(obstacle.name, "base", [cell.solid(obstacle.name)], _COLORS["obstacle"], stamp)
        for obstacle in cell.obstacles
    ]
    entities += [
        _entity(name, "flange", solids, _COLORS[name], stamp)
        for name, solids in carried_solids(cell, T_flange_tool).items()
    ]
    return {"deletions": [], "entities": entities}


def _entity(
    name: str, frame: str, solids: list[Solid] | tuple[Solid, ...], rgba: tuple[float, ...], stamp: int
) -> dict[str, Any]:
    color = dict(zip("rgba", rgba, strict=True))
    found: dict[str, Any] = {"cubes": [], "spheres": [], "cylinders": [], "triangles": []}
    for solid in solids:
        shape, common = solid.shape, {"pose": _pose(solid.pose), "color": color}
        if isinstance(shape, Box):
            found["cubes"].append({**common, "size": _vector(shape.size)})
        elif isinstance(shape, Sphere):
            found["spheres"].append({**common, "size": _vector((2.0 * shape.radius,) * 3)})
        elif isinstance(shape, Cylinder):
            size = _vector((2.0 * shape.radius, 2.0 * shape.radius, shape.length))
            found["cylinders"].append({**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0})
        else:
            mesh = shape_mesh(shape)
            points = [_vector(vertex) for vertex in mesh.vertices.tolist()]
            found["triangles"].append(
                {**common, "points": points, "colors": [], "indices": mesh.faces.ravel().tolist()}
            )
    return {
        "timestamp": _time(stamp),
        "frame_id": frame,
        "id": f"{frame}/{name}",
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **found,
    }


def _time(stamp: int) -> dict[str, int]:
    return {"sec": stamp // 1_000_000_000, "nsec": stamp % 1_000_000_000}


def _vector(values: Any) -> dict[str, float]:
    return dict(zip("xyz", values, strict=True))


def _pose(pose: Pose) -> dict[str, Any]:
    w, x, y, z = pose.wxyz.tolist()
    return {"position": _vector(pose.position.tolist()), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _numbers(*names: str) -> dict[str, Any]:
    return {"type": "object", "properties": {name: {"type": "number"} for name in names}}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


def _object(**properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


_TEXT: dict[str, Any] = {"type": "string"}
_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
}
_SIZE, _QUATERNION, _COLOR = _numbers("x", "y", "z"), _numbers("x", "y", "z", "w"), _numbers("r", "g", "b", "a")
_POSE = _object(position=_SIZE, orientation=_QUATERNION)
_SOLID = _object(pose=_POSE, size=_SIZE, color=_COLOR)
_CYLINDER = _object(pose=_POSE, size=_SIZE, color=_COLOR, bottom_scale={"type": "number"}, top_scale={"type": "number"})
_TRIANGLES = _object(
    pose=_POSE, points=_list(_SIZE), color=_COLOR, colors=_list(_COLOR), indices=_list({"type": "integer"})
)

POSE_SCHEMA = _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE) | {"title": "foxglove.PoseInFrame"}
TRANSFORM_SCHEMA = _object(
    timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_SIZE, rotation=_QUATERNION
) | {"title": "foxglove.FrameTransform"}
SCENE_SCHEMA = _object(
    deletions=_list(_object(timestamp=_TIME, type={"type": "integer"}, id=_TEXT)),
    entities=_list(
        _object(
            timestamp=_TIME,
            frame_id=_TEXT,
            id=_TEXT,
            lifetime=_TIME,
            frame_locked={"type": "boolean"},
            metadata=_list(_object(key=_TEXT, value=_TEXT)),
            cubes=_list(_SOLID),
            spheres=_list(_SOLID),
            cylinders=_list(_CYLINDER),
            triangles=_list(_TRIANGLES),
        )
    ),
) | {"title": "foxglove.SceneUpdate"}
