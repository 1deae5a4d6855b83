"""The cell as elements of MJCF: its obstacles as fixed geoms, tool and held part on the flange, without mass.

Bits of `conaffinity` say what a geom belongs to, those of `contype` of an obstacle what it stops: links, tool, part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from rcilab.cell.cell import Cell
from rcilab.cell.convex_parts import convex_parts
from rcilab.cell.shape_mesh import carried_solids
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Solid, Sphere
from rcilab.core.spatial import Pose
from rcilab.robots.mesh import Faces
from rcilab.robots.mjcf import Surroundings
from rcilab.robots.urdf import number_text, vector_text

LINK, TOOL, PART = 1, 2, 4
ALL = LINK | TOOL | PART
GROUP = 1
"""Geometry group of the solids; MuJoCo's viewers show it."""
_CARRIED = {"tool": TOOL, "part": PART}
_STIFFNESS = "0.005 1"
"""Time constant, [s], and damping ratio of contacts; tuning value: with MuJoCo's 0.02 s an arm that hits a solid at
0.5 m/s is 5 mm deep in it, with this 1 mm."""
_COLORS = {"obstacle": "0.62 0.66 0.72 1", "tool": "0.30 0.33 0.38 1", "part": "0.90 0.62 0.25 1"}


@dataclass(frozen=True, slots=True)
class CellElements:
    """A cell in MJCF."""

    surroundings: Surroundings
    """Its elements."""
    obstacles: Mapping[str, tuple[str, ...]]
    """Names of the geoms of each obstacle."""
    bodies: Mapping[str, str]
    """"tool" or "part" by the name of a carried geom."""


def cell_elements(cell: Cell, T_flange_tool: Pose, *, has_floor: bool = False) -> CellElements:
    """Returns the elements of a cell.

    Args:
        cell: The cell.
        T_flange_tool: Pose of the tool, of an arm whose cell has no tool.
        has_floor: Whether the floor of the cell is one of them.
    """
    build = _Builder()
    obstacles: dict[str, tuple[str, ...]] = {}
    for number, obstacle in enumerate(cell.obstacles, 1):
        stops = ALL & ~sum(_CARRIED[one] for one in set(obstacle.may_touch))
        contact = f'contype="{stops}" conaffinity="0" rgba="{_COLORS["obstacle"]}"'
        solid = cell.solid(obstacle.name)
        obstacles[obstacle.name] = build.add(build.world, f"obstacle {number}: {obstacle.name}", solid, contact)
    if has_floor and cell.floor_height is not None:
        build.world.append(
            f'<geom name="floor" type="plane" size="0 0 1" pos="0 0 {number_text(cell.floor_height)}" '
            f'contype="{ALL}" conaffinity="0" group="{GROUP}"/>'
        )
    bodies: dict[str, str] = {}
    for name, solids in carried_solids(cell, T_flange_tool).items():
        contact = f'contype="0" conaffinity="{_CARRIED[name]}" rgba="{_COLORS[name]}"'
        for number, solid in enumerate(solids, 1):
            bodies |= dict.fromkeys(build.add(build.carried, f"{name} {number}", solid, contact), name)
    added = Surroundings(assets=tuple(build.assets), world=tuple(build.world), carried=tuple(build.carried))
    return CellElements(added, obstacles, bodies)


@dataclass(slots=True)
class _Builder:
    """Collects elements. Owned by one call of `cell_elements`."""

    assets: list[str] = field(default_factory=list[str])
    world: list[str] = field(default_factory=list[str])
    carried: list[str] = field(default_factory=list[str])

    def add(self, lines: list[str], name: str, solid: Solid, contact: str) -> tuple[str, ...]:
        """Adds a solid, a mesh by its convex parts; returns the names of its geoms."""
        shape, forms = solid.shape, list[str]()
        if isinstance(shape, MeshShape):
            for number, (vertices, faces) in enumerate(convex_parts(shape), 1):
                mesh = quoteattr(f"{name}, part {number}")
                self.assets.append(
                    f'    <mesh name={mesh} vertex="{vector_text(vertices.ravel())}" face="{_face_text(faces)}"/>'
                )
                forms.append(f'type="mesh" mesh={mesh}')
        elif isinstance(shape, Box):
            forms.append(f'type="box" size="{vector_text(edge / 2.0 for edge in shape.size)}"')
        elif isinstance(shape, Cylinder):
            forms.append(f'type="cylinder" size="{vector_text((shape.radius, shape.length / 2.0))}"')
        elif isinstance(shape, Sphere):
            forms.append(f'type="sphere" size="{number_text(shape.radius)}"')
        else:
            forms.append('type="plane" size="1 1 1"')  # Infinite, whatever is drawn.
        pose = f'pos="{vector_text(solid.pose.position)}" quat="{vector_text(solid.pose.wxyz)}"'
        names = tuple(name if len(forms) == 1 else f"{name}, part {number}" for number in range(1, len(forms) + 1))
        for geom, form in zip(names, forms, strict=True):
            lines.append(
                f'<geom name={quoteattr(geom)} {form} {pose} {contact} mass="0" group="{GROUP}" '
                f'solref="{_STIFFNESS}" priority="1"/>'
            )
        return names


def _face_text(faces: Faces) -> str:
    numbers: Iterable[int] = faces.ravel().tolist()
    return " ".join(map(str, numbers))
