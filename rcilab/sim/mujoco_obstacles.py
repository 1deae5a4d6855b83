"""Obstacles of the MuJoCo plant: a floor, boxes, the walls of a safety box; those of a cell, which do not change.

A MuJoCo model has a fixed size, and compiling one takes many cycles of the controller. Therefore all geoms exist from
the start, switched off; placing an obstacle sets the values of its geom.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell
from rcilab.core.arrays import Array, as_vector
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.robots.mjcf import Surroundings
from rcilab.robots.shapes import tool_capsules
from rcilab.sim.mujoco_cell import ALL, LINK, TOOL, CellElements, cell_elements

MOST_BOXES = 16
_FLOOR = "floor"
_WALLS = tuple(f"wall{number}" for number in range(6))
_BOXES = tuple(f"box{number}" for number in range(MOST_BOXES))
_NEAR = 0.1  # [m] Largest distance of a box from a link that is measured.
_GAP = 1e-3  # [m] Remaining gap between a box that was moved and the arm.
_MAX_CLEARING = 5.0  # [m] Larger than any arm.
_DIRECTIONS = {
    "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1),
}  # fmt: skip


class Obstacles:
    """The obstacles of one arm. Owned by its plant; kept when another model is compiled.

    Args:
        cell: The cell of the arm; None without one.
    """

    def __init__(self, cell: Cell | None = None) -> None:
        self._cell = cell
        self._elements = CellElements(Surroundings(), {}, {})
        self._boxes: dict[str, tuple[float, float, float, Pose]] = {}
        height = None if cell is None else cell.floor_height
        self._has_floor, self._floor = height is not None, height or 0.0
        self._walls: SafetyBox | None = None
        self._model: Any = None

    @property
    def is_empty(self) -> bool:
        """Whether there are no obstacles."""
        return not ((self._cell and self._cell.obstacles) or self._boxes or self._has_floor or self._walls)

    def surroundings(self, model: RobotModel) -> Surroundings | None:
        """Returns the elements of the cell for the MJCF of an arm; None without a cell."""
        if self._cell is None:
            return None
        self._elements = cell_elements(self._cell, model.T_flange_tool)
        return self._elements.surroundings

    def add_to(self, spec: Any, mj: Any, model: RobotModel) -> None:
        """Adds the geoms to the `MjSpec` of an arm and disables contact between the arm's own geoms."""
        own = [geom for body in spec.bodies if body.name.startswith(("base", "link")) for geom in body.geoms]
        for geom in own:
            geom.contype, geom.conaffinity = 0, LINK
        if self._cell is not None:
            for geom in own[len(own) - len(tool_capsules(model.description, model.mounted)) :]:
                geom.conaffinity = TOOL  # The last geoms of the last link.
        for names, kind in (((_FLOOR, *_WALLS), mj.mjtGeom.mjGEOM_PLANE), (_BOXES, mj.mjtGeom.mjGEOM_BOX)):
            for name in names:
                size = [1.0, 1.0, 1.0]
                spec.worldbody.add_geom(name=name, type=kind, size=size, contype=ALL, conaffinity=0, group=4)

    def install(self, model: Any, mj: Any) -> None:
        """Installs all obstacles in a compiled model."""
        self._model, self._mj = model, mj
        # Not the trees of the middle phase, which were built for the poses at compile time.
        model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_MIDPHASE
        for name in (_FLOOR, *_WALLS, *_BOXES):
            model.geom_sameframe[model.geom(name).id] = 0
        self._apply()

    def place_box(self, name: str, size: ArrayLike, pose: Pose, data: Any) -> None:
        """Adds a box, or moves it; see `Plant.place_box`.

        Args:
            name: Its name.
            size: Edge lengths, shape (3,), [m].
            pose: Its pose in base.
            data: MuJoCo's data of the present arm, which must not overlap the box.
        """
        x, y, z = as_vector(size, 3, "box size", "m").tolist()
        if min(x, y, z) <= 0.0:
            raise InvalidValueError("box size", [x, y, z], "must be three lengths above 0 [m]").coded("box_size")
        if name not in self._boxes and len(self._boxes) == MOST_BOXES:
            problem = f"exceeds the limit of {MOST_BOXES} boxes; remove another"
            raise InvalidValueError("box", name, problem).coded("box_many", name=name, most=MOST_BOXES)
        before = dict(self._boxes)
        self._boxes[name] = (x, y, z, pose)
        self._apply()
        try:
            self._require_free(name, data)
        except InvalidValueError:
            self._boxes = before
            self._apply()
            raise

    def find_overlap(self, data: Any) -> str | None:
        """Returns which link of the arm, or what it carries, overlaps what is solid, as text; None if none does."""
        solids = [(f"the box {name!r}", slot) for slot, name in zip(_BOXES, self._boxes, strict=False)]
        placed = self._elements.obstacles.items()
        solids += [(f"the obstacle {name!r}", geom) for name, geoms in placed for geom in geoms]
        if self._cell is not None and self._has_floor:
            solids.append(("the floor of the cell", _FLOOR))
        for solid, geom in solids:
            depth, link = self._deepest(int(self._model.geom(geom).id), data)
            if depth > 0.0:
                return f"{link} overlaps {solid} by {1e3 * depth:.3g} mm"
        return None

    def _require_free(self, name: str, data: Any) -> None:
        """Refuses a box that overlaps the arm: MuJoCo would push the arm out."""
        index = int(self._model.geom(_BOXES[list(self._boxes).index(name)]).id)
        depth, link = self._deepest(index, data)
        if depth <= 0.0:
            return
        position = self._model.geom_pos[index].copy()
        distances = {
            axis: self._clearing_distance(index, data, np.array(direction)) for axis, direction in _DIRECTIONS.items()
        }
        self._model.geom_pos[index] = position
        axis = min(distances, key=lambda axis: distances[axis])
        distance = 1e-3 * math.ceil(1e3 * distances[axis])  # [m]
        problem = (
            f"would overlap {link} of the arm by {1e3 * depth:.0f} mm; place it {1e3 * distance:.0f} mm farther "
            f"along {axis}, or move the arm first"
        )
        raise InvalidValueError("box", name, problem).coded(
            "box_overlap", name=name, link=link, axis=axis, depth=float(depth), way=distance
        )

    def _deepest(self, solid: int, data: Any) -> tuple[float, str]:
        """Returns the depth of the deepest link in a solid, [m], and its name; 0 or less if none overlaps."""
        model, mj = self._model, self._mj
        mj.mj_kinematics(model, data)
        moves = model.body_weldid[model.geom_bodyid] != 0  # The base may stand in a table: neither of them moves.
        links = np.flatnonzero((model.geom_conaffinity & model.geom_contype[solid] != 0) & moves)
        distances = [mj.mj_geomDistance(model, data, int(link), solid, _NEAR, None) for link in links]
        nearest = int(np.argmin(distances))
        geom = model.geom(int(links[nearest]))
        body = str(model.body(int(geom.bodyid[0])).name)
        return -distances[nearest], self._elements.bodies.get(str(geom.name), body)

    def _clearing_distance(self, box: int, data: Any, direction: Array) -> float:
        """Returns how far a box has to move along a direction to be free of the arm, [m]."""
        position, distance = self._model.geom_pos[box].copy(), 0.0
        while distance < _MAX_CLEARING:
            depth, _ = self._deepest(box, data)
            if depth <= 0.0:
                break
            distance += depth + _GAP
            self._model.geom_pos[box] = position + distance * direction
        self._model.geom_pos[box] = position
        return distance

    def remove_box(self, name: str) -> None:
        """Removes a box; see `Plant.remove_box`."""
        if name not in self._boxes:
            known = ", ".join(self._boxes) or "none"
            raise InvalidValueError("box", name, f"does not exist; there are: {known}").coded("box_unknown", name=name)
        del self._boxes[name]
        self._apply()

    def set_floor(self, on: bool) -> None:
        """Adds or removes a solid floor at z = 0, or at the height of the cell's."""
        self._has_floor = on
        self._apply()

    def set_walls(self, box: SafetyBox | None) -> None:
        """Makes the faces of a box solid from inside; None removes them."""
        self._walls = box
        self._apply()

    def _apply(self) -> None:
        model, mj = self._model, self._mj
        self._show(_FLOOR, self._has_floor, (0.0, 0.0, self._floor), (1.0, 0.0, 0.0, 0.0))
        for slot, (position, wxyz) in zip(_WALLS, _faces(self._walls), strict=True):
            self._show(slot, self._walls is not None, position, wxyz)
        for slot in _BOXES[len(self._boxes) :]:
            self._show(slot, False, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        for slot, (x, y, z, pose) in zip(_BOXES, self._boxes.values(), strict=False):
            index = self._show(slot, True, pose.position, pose.wxyz)
            half = (x / 2.0, y / 2.0, z / 2.0)
            model.geom_size[index] = half
            model.geom_aabb[index] = (0.0, 0.0, 0.0, *half)
            model.geom_rbound[index] = math.hypot(*half)
        flags = model.opt.disableflags & ~int(mj.mjtDisableBit.mjDSBL_CONTACT)
        model.opt.disableflags = flags | (int(mj.mjtDisableBit.mjDSBL_CONTACT) if self.is_empty else 0)

    def _show(self, name: str, on: bool, position: ArrayLike, wxyz: ArrayLike) -> int:
        model = self._model
        index = int(model.geom(name).id)
        model.geom_contype[index] = ALL if on else 0
        model.geom_pos[index], model.geom_quat[index] = position, wxyz
        return index


def _faces(box: SafetyBox | None) -> list[tuple[ArrayLike, ArrayLike]]:
    """Returns position and quaternion of six planes whose z axes, the sides that are free, point into the box."""
    turns = {0: (0.0, 1.0, 0.0), 1: (-1.0, 0.0, 0.0), 2: (0.0, 0.0, 0.0)}  # of +z to +x, +y, +z by +90 degrees
    faces: list[tuple[ArrayLike, ArrayLike]] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):  # the lower face looks up its axis, the upper one down
            offset = np.zeros(3)
            size = 1.0 if box is None else box.size[axis]
            offset[axis] = sign * size / 2.0
            turn = np.array(turns[axis]) * -sign * math.pi / 2.0
            if axis == 2:
                turn = np.array([math.pi if sign > 0.0 else 0.0, 0.0, 0.0])
            T_base_box = Pose() if box is None else box.T_base_box
            T = T_base_box @ Pose.from_rpy(offset, turn)
            faces.append((T.position, T.wxyz))
    return faces
