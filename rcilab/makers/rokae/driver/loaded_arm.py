"""An arm as its controller describes it in the answer to LoadRobotModel, as a model, compared with the maker's table.

The answer has the Denavit-Hartenberg table, 43 base parameters and three friction coefficients per joint. Base
parameters determine the torques and not the inertias of single links. Here the inertias of the table are changed by the
least amount that gives the base parameters, each link with its mass: torques, gravity and mass matrix are those of the
controller. The vendor's library computes them with the lengths d of joints 1, 3, 5 and 7 alone and otherwise the
manual's geometry; so the inertias are found with that geometry, and then belong to the calibrated links.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import degrees, remainder, tau
from os import PathLike, fspath

import numpy as np

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.errors import ModelError
from rcilab.makers.rokae.base_parameters import ENTRIES, SERVED, random_states, regrouping
from rcilab.makers.rokae.wire import ModelResponse
from rcilab.model.arm_file import save_arm
from rcilab.model.robot_model import RobotModel
from rcilab.robots import DhRow, Link, RobotDescription
from rcilab.robots.upright import link_frames

_CALIBRATION = 5e-3  # [m] Tuning value: a larger difference is another arm.
_CONVENTION = 0.1  # [rad] Tuning value: a larger difference of an angle is another zero position.
_SAME = 1e-7  # [m], [rad], [kg m^2], [kg m] Differences within rounding are not listed.
_MASS = ENTRIES.index("m")
_UNITS = {"a": "mm", "alpha": "deg", "d": "mm", "theta": "deg", "mx": "kg m", "my": "kg m", "mz": "kg m"}
_FRICTION = (("viscous friction", "N m s/rad"), ("Coulomb friction", "N m"), ("friction offset", "N m"))


@dataclass(frozen=True, slots=True)
class Difference:
    """A number of the arm that is not that of the table."""

    joint: int
    """From 1."""
    parameter: str
    arm: float
    table: float
    unit: str

    def __str__(self) -> str:
        table = round(self.table, 9)  # Without what is left of rounding in regrouped parameters.
        return (
            f"joint {self.joint}  {self.parameter:<16}  {self.arm:12.6g} {self.unit:<9}  table {table:12.6g}  "
            f"{self.arm - table:+.3g}"
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LoadedArm:
    """An arm as its controller describes it. Printed, it is the table of what differs from the maker's table."""

    model: RobotModel
    """The arm, with calibrated geometry, identified dynamics and friction."""
    differences: tuple[Difference, ...]
    """Every number that differs from the table, by joint."""
    notes: tuple[str, ...]
    """What the controller does not report, or reports in a form that could not be used."""
    source: str
    """Where it comes from."""

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the arm to a JSON file; `load_model("my_arm.json")` loads it.

        Raises:
            InvalidValueError: The name does not end in .json, or the file cannot be written.
        """
        save_arm(self.model.description, fspath(file), self.source)

    def describe(self) -> str:
        """Returns the comparison in one sentence."""
        name = self.model.name
        if not self.differences:
            return f"{name}: the controller reports what is in the table"
        lengths = [entry for entry in self.differences if entry.unit == "mm"]
        parts = [f"{len(self.differences)} numbers differ from the table"]
        if lengths:
            most = max(lengths, key=lambda entry: abs(entry.arm - entry.table))
            parts.append(
                f"most of the lengths {most.parameter} of joint {most.joint}, by {most.arm - most.table:+.3g} mm"
            )
        nominal = self.model.description.nominal
        if nominal is not None:
            home = self.model.home
            ours, theirs = (RobotModel(arm).torque(home).gravity for arm in (self.model.description, nominal))
            joint = int(np.abs(ours - theirs).argmax())
            parts.append(
                f"gravity torque at home most at joint {joint + 1}, {ours[joint]:.2f} N m instead of "
                f"{theirs[joint]:.2f} N m"
            )
        return f"{name}: {'; '.join(parts)}"

    def __str__(self) -> str:
        notes = [f"note: {note}" for note in self.notes]
        return "\n".join((self.describe(), *map(str, self.differences), *notes))

    def __repr__(self) -> str:
        return f"<LoadedArm {self.describe()}; .model, .differences, .notes, .save>"


def build_loaded_arm(response: ModelResponse, table: RobotDescription, robot: str, session: RobotModel) -> LoadedArm:
    """Returns the arm in an answer to LoadRobotModel.

    Args:
        response: The answer.
        table: The arm of the maker's table.
        robot: Name of the controller.
        session: The model whose tool and load the arm gets.

    Raises:
        ModelError: Its lengths are not those of the arm.
    """
    source, notes = f"LoadRobotModel of {robot}", []
    dh = _calibrated_rows(response.dh, table, notes)
    parameters, friction = _dynamics(response, table.n, notes)
    links = table.links if parameters is None else _links_with(parameters, table, dh, source, notes)
    if friction is not None and (friction[:2] < 0.0).any():
        notes.append("negative friction coefficients are taken as zero")
        friction[:2] = np.maximum(friction[:2], 0.0)
    viscous, coulomb, offset = (None, None, None) if friction is None else map(readonly_copy, friction)
    arm = replace(
        table,
        dh=dh,
        dh_source=source,
        links=links,
        friction=None if viscous is None or coulomb is None or offset is None else (viscous, coulomb, offset),
        nominal=table,
    )
    found = (*_compare_rows(dh, table.dh), *_compare_dynamics(parameters, table), *_compare_friction(friction))
    return LoadedArm(
        model=RobotModel(arm, session.T_flange_tool, session.load, session.T_tool_stiffness),
        differences=tuple(sorted(found, key=lambda entry: entry.joint)),
        notes=tuple(notes),
        source=source,
    )


def _calibrated_rows(served: tuple[float, ...], table: RobotDescription, notes: list[str]) -> tuple[DhRow, ...]:
    """Returns the served rows in SI units; the table's where nothing usable is served."""
    if not any(served):
        notes.append("the controller serves no Denavit-Hartenberg table")
        return table.dh
    rows: list[DhRow] = []
    for number, own in enumerate(table.dh, 1):
        a, alpha, d, theta = served[4 * number - 4 : 4 * number]
        lengths = {"a": (a / 1000.0, own.a), "d": (d / 1000.0, own.d)}
        for name, (there, here) in lengths.items():
            if abs(there - here) > _CALIBRATION:
                raise ModelError(
                    f"{name} of joint {number} is {1e3 * there:g} mm at the controller and {1e3 * here:g} mm in the "
                    f"table of {table.name}, more than a calibration of {1e3 * _CALIBRATION:g} mm: it is another arm"
                )
        angles = {"alpha": (alpha, own.alpha), "theta": (theta, own.theta_offset)}
        kept: dict[str, float] = {}
        for name, (there, here) in angles.items():
            off = remainder(there - here, tau)
            kept[name] = here + off if abs(off) <= _CONVENTION else here
            if abs(off) > _CONVENTION:
                notes.append(
                    f"{name} of joint {number} is {degrees(there):g} deg at the controller and {degrees(here):g} deg "
                    "in the table, which is another zero position rather than a calibration: that of the table is used"
                )
        rows.append(DhRow(a=a / 1000.0, alpha=kept["alpha"], d=d / 1000.0, theta_offset=kept["theta"]))
    return tuple(rows)


def _dynamics(response: ModelResponse, n: int, notes: list[str]) -> tuple[Array | None, Array | None]:
    """Returns the base parameters and the friction, shape (3, n): viscous, Coulomb, offset; None if not served."""
    if n != len(SERVED) or not (any(response.dynamics_with_friction) or any(response.dynamics)):
        notes.append("the controller serves no dynamic parameters: the table's are used")
        return None, None
    full, friction = _split(response.dynamics_with_friction, 3)
    bare, _ = _split(response.dynamics, 0)
    if not any(response.dynamics_with_friction):
        return bare, None
    if any(response.dynamics) and np.abs(full - bare)[:-2].max() > 1e-6:
        notes.append("the parameters with and without friction differ: those with friction are used")
    if not friction.any():
        notes.append("the controller serves no friction")
        return full, None
    return full, friction


def _split(numbers: tuple[float, ...], friction: int) -> tuple[Array, Array]:
    """Returns the 43 parameters, and the friction coefficients, shape (friction, n); joint 1 has two unused entries."""
    ends = np.cumsum([0, 3 + friction, *(7 + friction for _ in SERVED[1:])]).tolist()
    blocks = [numbers[begin:end] for begin, end in pairwise(ends)]
    parameters = [x for block, names in zip(blocks, SERVED, strict=True) for x in block[: len(names)]]
    coefficients = [block[len(block) - friction :] for block in blocks]
    return np.array(parameters), np.array(coefficients).reshape(len(SERVED), friction).T


def _links_with(
    parameters: Array, table: RobotDescription, dh: tuple[DhRow, ...], source: str, notes: list[str]
) -> tuple[Link, ...]:
    """Returns links with these base parameters and the table's masses, as close to the table's as possible."""
    # The vendor's library takes d of every other row, and all else from the manual.
    rows = (replace(own, d=row.d) if own.d else own for own, row in zip(table.dh, dh, strict=True))
    A = regrouping(replace(table, dh=tuple(rows), nominal=table))
    own = _parameters_of(table)
    missing = parameters - A @ own
    if np.abs(missing).max() <= _SAME:
        return table.links
    sizes = np.array([link.mass * np.array((0.01,) * 6 + (0.1,) * 3 + (0.0,)) for link in table.links]).ravel()
    change = sizes * np.linalg.lstsq(A * sizes, missing, rcond=None)[0]
    change += sizes * np.linalg.lstsq(A * sizes, missing - A @ change, rcond=None)[0]  # Once more, against rounding.
    links = _links_of(own + change, table, source)
    body = RobotModel(replace(table, dh=dh, links=links, nominal=table)).rigid_body
    if all(np.linalg.eigvalsh(body.mass_matrix(q)).min() > 0.0 for q, _, _ in random_states(table.n)):
        return links
    notes.append("the dynamic parameters are those of no arm, its mass matrix is not positive: the table's are used")
    return table.links


def _parameters_of(table: RobotDescription) -> Array:
    """Returns all parameters of all links in their Denavit-Hartenberg frames, see `ENTRIES`, shape (10 n,)."""
    found: list[Array] = []
    for link, T in zip(table.links, link_frames(table), strict=True):
        R, c = T.rotation, T @ link.center_of_mass
        inertia = R @ link.inertia @ R.T + link.mass * (c @ c * np.eye(3) - np.outer(c, c))
        found.append(np.array((*inertia[np.triu_indices(3)], *(link.mass * c), link.mass)))
    return np.concatenate(found)


def _links_of(parameters: Array, table: RobotDescription, source: str) -> tuple[Link, ...]:
    """Returns the links with these parameters; the inverse of `_parameters_of`."""
    links: list[Link] = []
    rows = parameters.reshape(table.n, len(ENTRIES))
    for row, own, T in zip(rows, table.links, link_frames(table), strict=True):
        inertia = np.zeros((3, 3))
        inertia[np.triu_indices(3)] = row[:6]
        inertia += np.triu(inertia, 1).T
        mass, c, R = float(row[_MASS]), row[6:9] / row[_MASS], T.rotation
        inertia = R.T @ (inertia - mass * (c @ c * np.eye(3) - np.outer(c, c))) @ R
        center = R.T @ (c - T.position)
        links.append(
            replace(
                own,
                center_of_mass=readonly_copy(center),
                inertia=readonly_copy((inertia + inertia.T) / 2.0),
                source=source,
            )
        )
    return tuple(links)


def _compare_rows(dh: tuple[DhRow, ...], table: tuple[DhRow, ...]) -> Iterator[Difference]:
    for joint, (row, own) in enumerate(zip(dh, table, strict=True), 1):
        pairs = {
            "a": (1e3 * row.a, 1e3 * own.a),
            "alpha": (degrees(row.alpha), degrees(own.alpha)),
            "d": (1e3 * row.d, 1e3 * own.d),
            "theta": (degrees(row.theta_offset), degrees(own.theta_offset)),
        }
        for name, (arm, known) in pairs.items():
            if abs(arm - known) > 1e3 * _SAME:
                yield Difference(joint, name, arm, known, _UNITS[name])


def _compare_dynamics(parameters: Array | None, table: RobotDescription) -> Iterator[Difference]:
    if parameters is None:
        return
    known = iter(regrouping(table) @ _parameters_of(table))
    numbers = iter(parameters.tolist())
    for joint, names in enumerate(SERVED, 1):
        for name in names:
            arm, here = next(numbers), float(next(known))
            if abs(arm - here) > _SAME:
                yield Difference(joint, name, arm, here, _UNITS.get(name, "kg m^2"))


def _compare_friction(friction: Array | None) -> Iterator[Difference]:
    if friction is None:
        return
    for (name, unit), values in zip(_FRICTION, friction, strict=True):
        for joint, value in enumerate(values.tolist(), 1):
            if value:
                yield Difference(joint, name, value, 0.0, unit)
