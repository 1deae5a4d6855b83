"""Named poses: joint angles stored under names in a JSON file of the user."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, cast

from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_vector, described, readonly_copy
from rcilab.core.atomic_file import read_own_text, write_atomic
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.model.robot_model import RobotModel, require_model

FORMAT = "rcilab poses"
VERSION = 1
LONGEST_NAME = 40  # [characters] Fits into a list of the UI.


def default_file() -> Path:
    """Returns the path of the user's file, in $XDG_CONFIG_HOME/rcilab or ~/.config/rcilab."""
    config_home = os.environ.get("XDG_CONFIG_HOME", "")
    return (Path(config_home) if os.path.isabs(config_home) else Path.home() / ".config") / "rcilab" / "poses.json"


class NamedPoseStore:
    """The stored poses of one arm. Every call reads the file again, because other programs may write to it.

    Args:
        model: The arm; poses of other arms in the same file are not changed.
        file: The file; None is `default_file()`.
    """

    def __init__(self, model: RobotModel, file: Path | None = None) -> None:
        self._model = require_model(model)
        self.file = default_file() if file is None else file
        """The file of the poses."""

    def names(self) -> tuple[str, ...]:
        """Returns the names of the stored poses, in the order in which they were stored.

        Raises:
            InvalidValueError: The file cannot be read, or is not a pose file.
            VersionMismatchError: It was written by another version.
        """
        return tuple(self._own(self._read()))

    def recall(self, name: str) -> JointVector:
        """Returns the joint angles of a stored pose, shape (n,), [rad].

        Raises:
            InvalidValueError: No pose has this name, or it does not fit this arm; see also `names`.
            VersionMismatchError: See `names`.
        """
        own = self._own(self._read())
        if name not in own:
            known = ", ".join(own) or "none"
            raise InvalidValueError(
                "pose", described(name), f"is not stored for {self._model.name}; stored: {known}"
            ).coded("pose_unknown", name=name)
        limits = self._model.limits.joint
        try:
            q = as_vector(own[name], self._model.n, f"pose {name!r}", "rad")
        except InvalidValueError as error:
            raise self._file_error(f"{error}; correct or delete it").coded("pose_damaged", name=name) from error
        for joint, (low, angle, high) in enumerate(zip(limits.lower, q, limits.upper, strict=True), start=1):
            if not low <= angle <= high:
                raise self._file_error(
                    f"pose {name!r} has joint {joint} at {math.degrees(angle):.1f} deg, outside "
                    f"{math.degrees(low):.0f} to {math.degrees(high):.0f} deg; correct or delete it"
                ).coded("pose_damaged", name=name)
        return readonly_copy(q)

    def store(self, name: str, q: ArrayLike) -> str:
        """Stores joint angles under a new name, and returns the name as stored.

        Args:
            name: 1 to 40 characters; surrounding spaces are removed.
            q: Joint angles, shape (n,), [rad].

        Raises:
            InvalidValueError: The name is not valid or already used, q is not n finite numbers, or writing failed.
            VersionMismatchError: See `names`.
        """
        name = name.strip()
        if not name or len(name) > LONGEST_NAME or not name.isprintable():
            problem = f"must be 1 to {LONGEST_NAME} printable characters"
            raise InvalidValueError("name", described(name), problem).coded("pose_name", most=LONGEST_NAME)
        angles = as_vector(q, self._model.n, "q", "rad")
        content = self._read()
        own = self._own(content)
        if name in own:
            problem = "is already used: delete that pose first, or use another name"
            raise InvalidValueError("name", described(name), problem).coded("pose_taken", name=name)
        own[name] = [round(float(angle), 9) for angle in angles]
        self._write(content, own)
        return name

    def delete(self, name: str) -> None:
        """Deletes a stored pose; a missing one is not an error.

        Raises:
            InvalidValueError: The file cannot be read or written, or is not a pose file.
            VersionMismatchError: See `names`.
        """
        content = self._read()
        own = self._own(content)
        if own.pop(name, None) is not None:
            self._write(content, own)

    def _own(self, content: dict[str, Any]) -> dict[str, Any]:
        return dict(content["poses"].get(self._model.name, {}))

    def _read(self) -> dict[str, Any]:
        try:
            text = read_own_text(self.file)
        except FileNotFoundError:
            return {"format": FORMAT, "version": VERSION, "poses": {}}
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise self._file_error(f"cannot be read: {reason}").coded("unreadable") from error
        try:
            content: Any = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise self._file_error(f"is not valid JSON ({error}); correct it or move it away").coded(
                "poses_no_file"
            ) from error
        if not isinstance(content, dict) or cast("dict[str, Any]", content).get("format") != FORMAT:
            raise self._file_error("is not a pose file; correct it or move it away").coded("poses_no_file")
        found = cast("dict[str, Any]", content)
        if found.get("version") != VERSION:
            raise VersionMismatchError(f"{self.file}", found.get("version"), VERSION, "move the file away")
        poses = found.get("poses")
        if not isinstance(poses, dict) or not all(
            isinstance(one, dict) for one in cast("dict[str, Any]", poses).values()
        ):
            raise self._file_error("is not a pose file; correct it or move it away").coded("poses_no_file")
        return found

    def _write(self, content: dict[str, Any], own: dict[str, Any]) -> None:
        content = {**content, "poses": {**content["poses"], self._model.name: own}}
        try:
            write_atomic(self.file, json.dumps(content, ensure_ascii=False, indent=1) + "\n")
        except OSError as error:
            raise self._file_error(f"cannot be written: {error.strerror}").coded("unwritable") from error

    def _file_error(self, reason: str) -> InvalidValueError:
        return InvalidValueError("pose file", str(self.file), reason)
