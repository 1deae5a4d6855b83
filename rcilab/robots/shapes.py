"""Shapes of the arms from a few dimensions: housings, caps and flange as meshes, and capsules for collisions.

Modelled on the real arm. Every y joint is shared by two housings next to each other along its axis, the lower one at
negative y, the upper one at positive y (the centres of mass in the vendor's description alternate in the same way);
each ends with a domed grey cap. Between two y joints a housing returns to the middle, where the z joints divide it.
A housing is one smooth union of rods and cylinders; parts with sharp edges (collars, caps, foot, flange) are bodies of
revolution added to it.

Everything is designed for the upright arm in the base frame and then moved to the link frames of `upright.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np

from rcilab.core.arrays import Array, Vector3, readonly_copy
from rcilab.robots.description import MountedTool, RobotDescription, Rod
from rcilab.robots.mesh import Mesh, merge_meshes, mirror_y, revolve
from rcilab.robots.rod_shapes import cast, flange_plate, foot_plate
from rcilab.robots.surface import box, cut, cylinder, join, mesh_surface, rod, vase
from rcilab.robots.upright import upright_flange, upright_joints

ColorRole = Literal["shell", "cap", "dark"]

ROLE_COLORS: dict[ColorRole, tuple[int, int, int]] = {
    "shell": (238, 240, 242),
    "cap": (166, 172, 178),
    "dark": (70, 75, 82),
}
"""Colours of the roles on a live arm, RGB 0-255."""

_GAP = 0.0012  # [m] half the gap between two housings
_COLLAR = 0.014  # [m] width of the machined ring on each side of a gap
_COLLAR_HEIGHT = 0.0006  # [m] height of a collar above the cast housing
_FREE_SPACE = 0.006  # [m] free space around a joint cylinder for the neighbour's housing


_ROD_CELL = 1.45  # factor on the cell size of rods, which have no edges
_THICKNESS_FACTOR = 1.15  # factor on the thickness of the 7 kg arms


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A mesh of one colour, in the link's frame."""

    mesh: Mesh
    role: ColorRole


@dataclass(frozen=True, slots=True, eq=False)
class Capsule:
    """All points within `radius` of a line from `start` to `end`, in the link's frame, [m]."""

    start: Vector3
    end: Vector3
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class LinkShape:
    """Meshes and collision capsules of a link."""

    parts: tuple[Part, ...]
    capsules: tuple[Capsule, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ArmShape:
    """The base and the moving links, base to flange."""

    base: LinkShape
    links: tuple[LinkShape, ...]

    @property
    def triangles(self) -> int:
        """Number of triangles of the whole arm."""
        return sum(len(part.mesh.faces) for link in (self.base, *self.links) for part in link.parts)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Joint:
    """A joint of the upright arm, for the design of housings."""

    axis: Literal["y", "z"]
    height: float
    """Height of the axis (y) or of the gap between the housings (z), [m]."""
    radius: float
    """Radius of the housings at the joint, [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fineness:
    cell: float
    """Edge of a grid cell of the cast housings, [m]."""
    segments: int
    """Facets around a body of revolution."""


_FINENESS = {
    "fine": _Fineness(cell=0.0095, segments=52),
    "coarse": _Fineness(cell=0.0180, segments=26),
}


def tool_capsules(description: RobotDescription, tool: MountedTool | None) -> tuple[Capsule, ...]:
    """Returns the capsules of a mounted tool in the last link's frame; none without a tool."""
    if tool is None:
        return ()
    R = upright_flange(description).rotation
    return tuple(Capsule(readonly_copy(R @ rod.start), readonly_copy(R @ rod.end), rod.radius) for rod in tool.rods)


@lru_cache(maxsize=16)
def build_shapes(description: RobotDescription, quality: Literal["fine", "coarse"] = "fine") -> ArmShape:
    """Returns the shapes of an arm.

    Args:
        description: The arm: one described as rods, or one of the xMate family's build, with axes z y z y z y z or
            z y y z y z.
        quality: "fine" for the screen, "coarse" for files and for ghosts.
    """
    fine = _FINENESS[quality]
    if description.rods is not None:
        return _rod_arm(description, description.rods, fine)
    if description.rated_payload >= 5.0:  # The same number of triangles on a larger arm.
        fine = _Fineness(cell=_THICKNESS_FACTOR * fine.cell, segments=fine.segments)
    joints = _design_joints(description)
    flange = description.links[-1].origin_height
    pedestal = _pedestal(joints[0], fine)
    housings = [_housing(low, high, fine) for low, high in pairwise(joints)]
    bodies = [*housings, _wrist_plate(joints[-1], flange, fine)]
    links = tuple(_in_frame(body, link.origin_height) for body, link in zip(bodies, description.links, strict=True))
    return ArmShape(base=pedestal, links=links)


def _rod_arm(description: RobotDescription, rods: tuple[tuple[Rod, ...], ...], fine: _Fineness) -> ArmShape:
    """Returns the shapes of an arm that is described as rods."""
    base, *links = (
        LinkShape(
            (Part(cast(of_link, _ROD_CELL * fine.cell), "shell"),),
            tuple(_capsule(rod.start, rod.end, rod.radius) for rod in of_link),
        )
        for of_link in rods
    )
    foot = Part(foot_plate(1.3 * rods[0][-1].radius, fine.segments), "cap")
    flange = Part(flange_plate(upright_flange(description).rotation, fine.segments), "dark")
    base = LinkShape((foot, *base.parts), base.capsules)
    links[-1] = LinkShape((flange, *links[-1].parts), links[-1].capsules)
    return ArmShape(base=base, links=tuple(links))


def _in_frame(shape: LinkShape, height: float) -> LinkShape:
    """Returns the shape of a link, moved from the base frame to its own frame."""
    down = np.array([0.0, 0.0, -height])
    return LinkShape(
        tuple(Part(part.mesh.moved(down), part.role) for part in shape.parts),
        tuple(Capsule(readonly_copy(c.start + down), readonly_copy(c.end + down), c.radius) for c in shape.capsules),
    )


def _design_joints(description: RobotDescription) -> list[_Joint]:
    """Returns the joints between housings. Radii decrease from base to flange; the 7 kg arms are thicker."""
    strength = 1.0 if description.rated_payload < 5.0 else _THICKNESS_FACTOR
    heights = [link.origin_height for link in description.links]
    axes: list[Literal["y", "z"]] = ["y" if abs(joint.axis[1]) > 0.5 else "z" for joint in upright_joints(description)]
    radii = np.interp(np.linspace(0.0, 1.0, len(axes)), [0.0, 0.5, 1.0], [0.064, 0.056, 0.045]) * strength
    joints: list[_Joint] = []
    for i, (axis, radius) in enumerate(zip(axes, radii.tolist(), strict=True)):
        height = heights[i]
        if i == 0:
            height = heights[1] - 2.75 * radius
        elif i == len(axes) - 1:
            height = heights[i] - 0.078 * strength
        elif axis == "z":
            below, above = heights[i - 1], heights[i + 1]
            height = below + 0.56 * (above - below)
        joints.append(_Joint(axis=axis, height=height, radius=radius))
    return joints


def _width(joint: _Joint) -> float:
    """Returns the distance of a y joint's outer faces from the middle, [m]."""
    return 1.42 * joint.radius


def _housing(low: _Joint, high: _Joint, fine: _Fineness) -> LinkShape:
    """Returns the link between two joints; at y joints it is at +y of its own joint and at -y of the next one."""
    ends = [(low, +1.0, +1.0), (high, -1.0, -1.0)]  # joint, side in y, direction in z into the housing

    stations = [end.height + up * (_COLLAR + 0.01 if end.axis == "z" else 1.4 * end.radius) for end, _, up in ends]
    radii = [end.radius - _COLLAR_HEIGHT if end.axis == "z" else 0.90 * end.radius for end, _, _ in ends]
    tips = [end.height + up * (0.002 if end.axis == "z" else 1.0 * end.radius) for end, _, up in ends]

    def body(p: Array) -> Array:
        d = vase(p, tips, stations, radii)
        for end, side, up in ends:
            if end.axis == "z":
                continue
            r, w = end.radius, _width(end)
            near, far = sorted((side * _GAP, side * w))
            hub = cylinder(p, 1, near, far, r, 0.22 * r, (0.0, end.height))
            neck = rod(
                p, (0.0, side * 0.36 * w, end.height), (0.0, 0.0, end.height + up * 1.75 * r), 0.78 * r, 0.88 * r
            )
            d = join(join(d, neck, 0.030), hub, 0.028)
        for end, side, _ in ends:
            if end.axis == "y":
                near, far = sorted((-side * 0.3, side * _GAP))
                room = cylinder(p, 1, near, far, end.radius + _FREE_SPACE, 0.0, (0.0, end.height))
                d = np.maximum(cut(d, room, 0.014), side * p[:, 1] - _width(end))
        return d

    reach = 1.5 * max(low.radius, high.radius) + 0.02
    bottom = low.height - (1.3 * low.radius if low.axis == "y" else 0.03)
    top = high.height + (1.3 * high.radius if high.axis == "y" else 0.03)
    half = 1.25 * max(low.radius, high.radius)
    parts = [Part(mesh_surface(body, (-half, -reach, bottom), (half, reach, top), fine.cell), "shell")]
    for end, side, up in ends:
        parts += _trim(end, side, up, fine)
    parts += _gap_ring(high, fine)
    return LinkShape(_by_role(parts), tuple(_housing_capsules(ends)))


def _housing_capsules(ends: list[tuple[_Joint, float, float]]) -> list[Capsule]:
    """Returns one capsule through the middle and one along each y joint; they protrude slightly beyond the caps."""
    middle = [
        (0.0, 0.0, end.height + up * 0.35 * end.radius)
        if end.axis == "z"
        else (0.0, side * 0.2 * end.radius, end.height + up * end.radius)
        for end, side, up in ends
    ]
    capsules = [_capsule(middle[0], middle[1], 1.03 * max(end.radius for end, _, _ in ends))]
    for end, side, _ in ends:
        if end.axis == "y":
            near, far = side * 0.3 * end.radius, side * (_width(end) - 0.7 * end.radius)
            capsules.append(_capsule((0.0, near, end.height), (0.0, far, end.height), 1.02 * end.radius))
    return capsules


def _capsule(start: tuple[float, float, float], end: tuple[float, float, float], radius: float) -> Capsule:
    """Returns a capsule rounded to micrometres, which keeps files readable."""
    return Capsule(readonly_copy(np.round(start, 6)), readonly_copy(np.round(end, 6)), round(radius, 6))


def _trim(end: _Joint, side: float, up: float, fine: _Fineness) -> list[Part]:
    """Returns the collar at a joint and, at a y joint, the cap on the outer face."""
    r = end.radius
    collar = [(r - 0.008, _GAP), (r - 0.0016, _GAP), (r, _GAP + 0.0016), (r, _COLLAR), (r - 0.0012, _COLLAR + 0.0008)]
    if end.axis == "z":
        mesh = revolve(
            collar if up > 0 else [(q, -h) for q, h in reversed(collar)],
            center=(0, 0, end.height),
            segments=fine.segments,
        )
        return [Part(mesh, "shell")]
    w = _width(end)
    rim = 0.74 * r
    groove = [(rim + 0.0035, w - 0.004), (rim + 0.0035, w + 0.0004), (rim - 0.004, w + 0.0004)]
    dome = [(rim, w - 0.003), (rim, w + 0.0016), (rim - 0.0010, w + 0.0026)]
    dome += [(rim * k, w + 0.0026 + 0.0045 * (1.0 - k * k)) for k in (0.93, 0.8, 0.6, 0.4, 0.2, 0.0)]
    parts = [
        Part(revolve(collar, axis="y", segments=fine.segments), "shell"),
        Part(revolve(groove, axis="y", segments=fine.segments), "dark"),
        Part(revolve(dome, axis="y", segments=fine.segments), "cap"),
    ]
    if side < 0:
        parts = [Part(mirror_y(part.mesh), part.role) for part in parts]
    return [Part(part.mesh.moved((0.0, 0.0, end.height)), part.role) for part in parts]


def _gap_ring(joint: _Joint, fine: _Fineness) -> list[Part]:
    """Returns the dark ring in the gap of the joint at a housing's upper end."""
    r, h = joint.radius - 0.0022, 2.0 * _GAP
    ring = revolve([(r, -h), (r, h)], axis=joint.axis, center=(0.0, 0.0, joint.height), segments=fine.segments)
    return [Part(ring, "dark")]


def _by_role(parts: list[Part]) -> tuple[Part, ...]:
    """Merges the meshes of each colour, trim before castings, so that hidden parts stay hidden if translucent."""
    parts = parts[::-1]
    roles: dict[ColorRole, None] = dict.fromkeys(part.role for part in parts)
    return tuple(Part(merge_meshes([p.mesh for p in parts if p.role == role]), role) for role in roles)


def _pedestal(joint: _Joint, fine: _Fineness) -> LinkShape:
    """Returns the base: foot plate, column, connector box at the back (-x) and ring under joint 1."""
    r, top = joint.radius, joint.height

    def body(p: Array) -> Array:
        column = vase(p, (-0.03, top - 0.002), (0.02, top - _COLLAR - 0.01), (r * 1.16, r - _COLLAR_HEIGHT))
        foot = cylinder(p, 2, -0.03, 0.030, r * 1.36, 0.014, (0.0, 0.0))
        back = box(p, (-0.95 * r, 0.0, 0.062), (0.75 * r, 0.66 * r, 0.042), 0.014)
        d = join(join(column, foot, 0.035), back, 0.022)
        return np.maximum(d, -p[:, 2])

    half = 1.6 * r
    shell = mesh_surface(body, (-1.9 * r, -half, -0.015), (half, half, top + 0.02), fine.cell)
    plate = [(0.0, 0.0), (1.50 * r, 0.0), (1.50 * r, 0.0105), (1.50 * r - 0.0015, 0.012), (1.2 * r, 0.012)]
    parts = [Part(shell, "shell"), Part(revolve(plate, segments=fine.segments), "cap")]
    parts += _trim(joint, 1.0, -1.0, fine) + _gap_ring(joint, fine)
    for y in (-0.30 * r, 0.30 * r):  # two round connectors
        socket = [(0.0105, -0.004), (0.0105, 0.006), (0.0085, 0.006), (0.0085, 0.001), (0.0, 0.001)]
        mesh = revolve(socket, axis="x", segments=24)
        parts.append(
            Part(Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1]).moved((-1.70 * r, y, 0.062)), "dark")
        )
    solid = _capsule((0.0, 0.0, 1.15 * r), (0.0, 0.0, top - 0.35 * r), 1.15 * r)
    box_solid = _capsule((-1.15 * r, 0.0, 0.062), (0.0, 0.0, 0.062), 0.062)
    return LinkShape(_by_role(parts), (solid, box_solid))


def _wrist_plate(joint: _Joint, flange: float, fine: _Fineness) -> LinkShape:
    """Returns the last link: a ring with the pilot's button pad at +y, and the dark ISO flange with its bolts."""
    r, low = joint.radius, joint.height
    face = flange - 0.016

    def body(p: Array) -> Array:
        drum = cylinder(p, 2, low - 0.03, face - 0.003, r - _COLLAR_HEIGHT, 0.002, (0.0, 0.0))
        pad = rod(p, (0.0, 0.70 * r, low + 0.036), (0.0, 0.70 * r, face - 0.42 * r - 0.004), 0.46 * r, 0.42 * r)
        return np.maximum(join(drum, pad, 0.016), low + 0.004 - p[:, 2])

    half = 1.35 * r
    shell = mesh_surface(body, (-half, -half, low - 0.02), (half, half, flange), fine.cell * 0.8)
    outer = 0.0315 if r < 0.05 else 0.040  # [m] ISO 9409-1-50 and -63
    circle, bolt = (0.025, 0.0032) if r < 0.05 else (0.0315, 0.0036)
    plate = [
        (outer + 0.004, face - 0.003),
        (outer + 0.004, face + 0.003),
        (outer, face + 0.005),
        (outer, flange - 0.001),
        (outer - 0.001, flange),
        (0.0125, flange),
        (0.0125, flange - 0.005),
        (0.0, flange - 0.005),
    ]
    bend = np.linspace(0.0, np.pi / 2.0, 6)
    shoulder = [(r - 0.0012, face - 0.0178), (r, face - 0.017)]
    shoulder += [(r - 0.005 + 0.005 * np.cos(t), face - 0.005 + 0.005 * np.sin(t)) for t in bend] + [(outer, face)]
    parts = [Part(shell, "shell"), Part(revolve(shoulder, segments=fine.segments), "shell")]
    parts += [Part(revolve(plate, segments=fine.segments), "dark"), *_trim(joint, 1.0, 1.0, fine)]
    for angle in np.arange(6) * (np.pi / 3.0) + np.pi / 6.0:
        head = [(bolt, flange - 0.001), (bolt, flange + 0.0002), (0.0, flange + 0.0002)]
        parts.append(
            Part(revolve(head, center=(circle * np.cos(angle), circle * np.sin(angle), 0.0), segments=12), "cap")
        )
    solid = _capsule((0.0, 0.0, low + 0.4 * r), (0.0, 0.0, flange - 0.9 * r), 1.05 * r)
    return LinkShape(_by_role(parts), (solid,))
