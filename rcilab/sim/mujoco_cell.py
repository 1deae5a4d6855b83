"""The cell in a MuJoCo model: its obstacles as fixed geoms, tool and held part as bodies on the last link.

Bits of `conaffinity` say what a geom belongs to, those of `contype` of an obstacle what it stops: links, tool, part.
"""

from __future__ import annotations

from typing import Any

from rcilab.cell.cell import Cell
from rcilab.cell.convex_parts import convex_parts
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Solid, Sphere
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.robots.shapes import tool_capsules
from rcilab.robots.upright import upright_flange

LINK, TOOL, PART = 1, 2, 4
ALL = LINK | TOOL | PART
_CARRIED = {"tool": TOOL, "part": PART}
_STIFFNESS = (0.005, 1.0)
"""Time constant, [s], and damping ratio of contacts; tuning value: with MuJoCo's 0.02 s an arm that hits a
solid at 0.5 m/s is 5 mm deep in it, with this 1 mm."""


def add_carried(spec: Any, mj: Any, cell: Cell, model: RobotModel) -> None:
    """Adds the bodies of tool and held part to an `MjSpec`, without mass: that of the load is in the model.

    Args:
        spec: The arm, whose geoms have `conaffinity` LINK.
        mj: The module mujoco.
        cell: The cell.
        model: The arm.
    """
    last = spec.body(f"link{model.n}")
    mounted = len(tool_capsules(model.description, model.mounted))
    for geom in last.geoms[len(last.geoms) - mounted :]:
        geom.conaffinity = TOOL
    part = cell.part
    groups = (
        ("tool", TOOL, () if cell.tool is None else cell.tool.solids_at()),
        ("part", PART, () if part is None else part.at_flange(cell.applied_to(model).T_flange_tool)[1]),
    )
    T_link_flange = upright_flange(model.description)
    for name, bit, solids in groups:
        if solids:
            body = last.add_body(name=name, pos=T_link_flange.position, quat=T_link_flange.wxyz)
            for number, solid in enumerate(solids):
                _add_geoms(spec, mj, body, f"{name} {number}", solid, conaffinity=bit)


def add_obstacles(spec: Any, mj: Any, cell: Cell) -> dict[str, list[str]]:
    """Adds the obstacles to an `MjSpec`; returns the names of the geoms of each.

    Args:
        spec: The arm.
        mj: The module mujoco.
        cell: The cell.
    """
    names: dict[str, list[str]] = {}
    for number, obstacle in enumerate(cell.obstacles):
        stops = ALL & ~sum(_CARRIED[one] for one in set(obstacle.may_touch))
        solid = cell.solid(obstacle.name)
        names[obstacle.name] = _add_geoms(spec, mj, spec.worldbody, f"obstacle {number}", solid, contype=stops)
    return names


def _add_geoms(
    spec: Any, mj: Any, body: Any, name: str, solid: Solid, *, contype: int = 0, conaffinity: int = 0
) -> list[str]:
    """Adds a solid to a body, a mesh by its convex parts; returns the names of the geoms."""
    shape, kinds = solid.shape, mj.mjtGeom
    forms: list[dict[str, Any]]
    if isinstance(shape, MeshShape):
        forms = []
        for number, (vertices, faces) in enumerate(convex_parts(shape)):
            mesh = f"{name} {number}"
            spec.add_mesh(name=mesh, uservert=vertices.ravel().tolist(), userface=faces.ravel().tolist())
            forms.append({"type": kinds.mjGEOM_MESH, "meshname": mesh})
    elif isinstance(shape, Box):
        forms = [{"type": kinds.mjGEOM_BOX, "size": [edge / 2.0 for edge in shape.size]}]
    elif isinstance(shape, Cylinder):
        forms = [{"type": kinds.mjGEOM_CYLINDER, "size": [shape.radius, shape.length / 2.0, 0.0]}]
    elif isinstance(shape, Sphere):
        forms = [{"type": kinds.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0]}]
    else:
        forms = [{"type": kinds.mjGEOM_PLANE, "size": [1.0, 1.0, 1.0]}]  # Infinite, whatever is drawn.
    pose: Pose = solid.pose
    for number, form in enumerate(forms):
        body.add_geom(
            name=f"{name} {number}", pos=pose.position, quat=pose.wxyz, mass=0.0, group=4,
            contype=contype, conaffinity=conaffinity, solref=_STIFFNESS, priority=1, **form,
        )  # fmt: skip
    return [f"{name} {number}" for number in range(len(forms))]
