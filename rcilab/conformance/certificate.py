"""The proof that a motion was checked for one arm and one start."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell
from rcilab.cell.wire_rounding import without_rounding
from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.conformance.start import StartState, as_start
from rcilab.core.arrays import Unquoted
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import CertificateError, InvalidValueError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import Pose
from rcilab.core.state import Mode
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.motion import Motion, require_motion

NO_SAFETY_BOX = "none"
"""Certificate part of a motion that was checked without a safety box."""
NO_CELL = "none"
"""Certificate part of a motion that was checked without a cell."""
NOT_CHECKED = "not judged"  # The text is part of certificates in saved runs.
"""Certificate part of a motion whose distances were not checked; such a motion cannot be executed."""

MODEL_PARTS = ("model", "limits", "tool", "load")
_CONTROLLERS = ("tool", "load")
"""Parts that a controller may have otherwise than the model."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """Fingerprints of all inputs of the check of a conforming motion. A plain value, to be sent between processes."""

    entries: tuple[tuple[str, str], ...]
    """Name and fingerprint of each part."""
    start_q: tuple[float, ...]
    """Commanded joint angles at the start of the check, [rad]."""

    @property
    def parts(self) -> Mapping[str, str]:
        """Fingerprints by name: motion, `MODEL_PARTS`, safety box, safety distance, cell, mode, start state."""
        return MappingProxyType(dict(self.entries))

    @property
    def digest(self) -> str:
        """One SHA-256 over all parts, hexadecimal."""
        return hashlib.sha256(repr(self.entries).encode()).hexdigest()

    def verify(
        self,
        motion: Motion,
        model: RobotModel,
        start_q: ArrayLike | StartState,
        box: SafetyBox | None = None,
        distance: ClearanceLimit | None = None,
        mode: Mode = "joint_position",
        cell: Cell | None = None,
    ) -> None:
        """Requires that this certificate is for this motion on this arm from this start.

        Args:
            motion: The motion to run.
            model: The arm, with its current tool and load.
            start_q: Current commanded joint angles (`state.q_c`), shape (n,), [rad]; or a StartState for a moving arm.
            box: The safety box that is set. Without an active one, a motion that was checked inside a box is accepted
                too.
            distance: Required distances of the links from each other and from the floor; None accepts those of the
                check. A motion whose distances were not checked is refused.
            mode: Mode in which the motion will run; each mode has its own conditions.
            cell: The cell of the arm, whose tool and load the model must have but for the rounding of a controller's
                interface. Without one, a motion that was checked in a cell is accepted too.

        Raises:
            CertificateError: Something differs from the check; `.changed` and the message name it.
            InvalidValueError: The motion, the model or the start is not valid for this arm.
        """
        require_motion(motion)
        require_model(model)
        if cell is not None:
            model = without_rounding(model, cell)
        start = as_start(start_q, len(self.start_q)) if motion.n == len(self.start_q) else None
        current = {"motion": ""}
        if start is not None:
            current = dict(issue_certificate(motion, model, start, box, distance, mode, cell).entries)
        changed = [name for name, fingerprint in self.entries if current.get(name, fingerprint) != fingerprint]
        if start is not None and "start state" in changed and self._same_start(start):
            changed.remove("start state")
        if "safety box" in changed and active_box(box) is None:
            changed.remove("safety box")
        if "cell" in changed and cell is None:
            changed.remove("cell")
        if "safety distance" in changed and distance is None:
            changed.remove("safety distance")
        if self.parts.get("safety distance") == NOT_CHECKED and "safety distance" not in changed:
            changed.append("safety distance")
        if changed:
            raise CertificateError(self._reason(changed, start, mode, model, cell), changed)

    def __repr__(self) -> str:
        return f"<Certificate {self.digest[:8]} for motion {self.parts['motion'][:8]}>"

    def _same_start(self, start: StartState) -> bool:
        is_near = np.abs(start.q - np.array(self.start_q)).max() <= START_POSITION_TOLERANCE
        moved = StartState(np.array(self.start_q), start.dq, start.ddq)
        return bool(is_near) and self.parts["start state"] == _start_fingerprint(moved)

    def _reason(
        self, changed: list[str], start: StartState | None, mode: Mode, model: RobotModel, cell: Cell | None
    ) -> str:
        if changed == ["start state"] and start is not None:
            offset = start.q - np.array(self.start_q)
            i = int(np.abs(offset).argmax())
            if abs(offset[i]) > START_POSITION_TOLERANCE:
                return (
                    f"the motion was checked from another start: joint {i + 1} is commanded to "
                    f"{degrees(start.q[i]):.4f}°, the motion starts at {degrees(self.start_q[i]):.4f}°; "
                    f"plan it again from the arm's commanded position (state.q_c)"
                )
            return "the motion was checked from another start: the velocity of the arm has changed; plan it again"
        if changed == ["motion"]:
            return "the certificate is that of another motion; check this one"
        if changed == ["mode"]:
            return (
                f"the motion was checked for the mode {self.parts['mode']}, not for the mode {mode}, "
                f"which has other conditions; check it again with mode={mode!r}"
            )
        if changed == ["safety box"]:
            return (
                "the certificate is stale: it does not cover the safety box that is set; check the motion again "
                "with box=..., the box passed to robot.set_safety_box"
            )
        if changed == ["cell"]:
            return (
                "the certificate is stale: it does not cover the cell that is set; check the motion again with "
                "cell=robot.cell"
            )
        if changed == ["safety distance"]:
            if self.parts["safety distance"] == NOT_CHECKED:
                return "collisions were not checked: check the motion again, without distance=None"
            return (
                "the certificate is stale: it does not cover the required safety distance; check the motion "
                "again with that distance=..."
            )
        if changed[0] in _CONTROLLERS and changed[-1] in _CONTROLLERS:
            return _describe_other_setup(changed, model, cell)
        what = " and ".join(filter(None, (", ".join(changed[:-1]), changed[-1])))
        verb = "has" if len(changed) == 1 else "have"
        return f"the certificate is stale: {what} {verb} changed since the motion was checked; check it again"


def _describe_other_setup(changed: list[str], model: RobotModel, cell: Cell | None) -> str:
    tool, load = model.T_flange_tool.position, model.load
    has = {
        "tool": f"tool at {', '.join(f'{1e3 * x:.6g}' for x in tool.tolist())} mm from the flange",
        "load": f"load of {load.mass:g} kg",
    }
    has_turn = "tool" in changed and not model.T_flange_tool.is_close(Pose(tool))
    remedy = (
        "check it with robot.model, or send what your model has: connect(..., apply=True)"
        if cell is None
        else "send those of the cell: robot.set_cell(cell, apply=True)"
    )
    return (
        f"the motion was checked with another {' and '.join(changed)} than the arm has: a "
        f"{' and a '.join(has[name] for name in changed)}{', turned' if has_turn else ''}; {remedy}"
    )


def issue_certificate(
    motion: Motion,
    model: RobotModel,
    start: StartState,
    box: SafetyBox | None = None,
    distance: ClearanceLimit | None = None,
    mode: Mode = "joint_position",
    cell: Cell | None = None,
) -> Certificate:
    """Returns the certificate of a motion; only for a report that is ok."""
    fingerprints = model.fingerprint
    parts = {
        "motion": motion.fingerprint,
        **{name: fingerprints[name] for name in MODEL_PARTS},
        "safety box": _box_fingerprint(box),
        "safety distance": _distance_fingerprint(distance),
        "cell": NO_CELL if cell is None else cell.fingerprint,
        "mode": mode,
        "start state": _start_fingerprint(start),
    }
    return Certificate(tuple(parts.items()), tuple(start.q.tolist()))


def require_certificate(certificate: object) -> None:
    """Requires a certificate, or None; a report in its place is an easy slip.

    Raises:
        InvalidValueError: It is something else; the message says what to pass.
    """
    if hasattr(certificate, "certificate"):
        raise InvalidValueError("certificate", Unquoted("pass report.certificate,"), "not the report")
    if certificate is not None and not isinstance(certificate, Certificate):
        raise InvalidValueError("certificate", certificate, "must be a Certificate; pass report.certificate")


def _start_fingerprint(start: StartState) -> str:
    state = np.stack([start.q, start.dq, start.ddq]) + 0.0  # Makes -0.0 and 0.0 the same bytes.
    return hashlib.sha256(state.tobytes()).hexdigest()


def _distance_fingerprint(distance: ClearanceLimit | None) -> str:
    return NOT_CHECKED if distance is None else hashlib.sha256(repr(distance).encode()).hexdigest()


def _box_fingerprint(box: SafetyBox | None) -> str:
    active = active_box(box)
    if active is None:
        return NO_SAFETY_BOX
    return hashlib.sha256(repr((active.size, active.T_base_box.as_row_major())).encode()).hexdigest()
