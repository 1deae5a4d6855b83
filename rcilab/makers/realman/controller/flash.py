"""The memory of a controller: what it keeps over a restart, in the user's data folder."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import msgspec

from rcilab.core.atomic_file import replacing
from rcilab.makers.realman.controller.joint_parameters import JointParameters, JointSet


class _Stored(msgspec.Struct):
    controller: JointSet
    drive: JointSet
    zero: tuple[float, ...]


def flash_file(model: str, port: int) -> Path:
    """Returns the file of an arm's controller at a TCP port: in $XDG_DATA_HOME/rcilab, or ~/.local/share/rcilab."""
    named = os.environ.get("XDG_DATA_HOME", "")
    home = Path(named) if named.startswith("/") else Path.home() / ".local" / "share"
    return home / "rcilab" / f"realman-{model}-{port}.json"


class Flash:
    """The stored parameters of one controller.

    Args:
        file: Where they are; None: nothing is kept.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file

    def load(self, new: JointParameters) -> tuple[JointParameters, str]:
        """Returns the stored parameters, or those of a new arm and why."""
        if self._file is None or not self._file.exists():
            return new, ""
        try:
            stored = msgspec.json.decode(self._file.read_bytes(), type=_Stored)
            return _checked(new, stored), ""
        except (OSError, ValueError) as error:
            return new, f"{self._file} cannot be read, so the joints have the parameters of a new arm: {error}"

    def store(self, parameters: JointParameters) -> str:
        """Stores parameters; returns why it was not possible, or nothing."""
        if self._file is None:
            return ""
        stored = _Stored(parameters.controller, parameters.drive, parameters.zero)
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self._file) as stream:
                stream.write(msgspec.json.encode(stored))
        except OSError as error:
            return f"{self._file} cannot be written, so the parameters are lost at the end: {error.strerror}"
        return ""

    def forget(self) -> None:
        """Deletes what is stored."""
        if self._file is not None:
            self._file.unlink(missing_ok=True)


def _checked(new: JointParameters, stored: _Stored) -> JointParameters:
    """Returns stored parameters after the checks of a client's values.

    Raises:
        ValueError: One is not valid.
    """
    n = len(new.zero)
    parameters = new
    for values, is_drive in ((stored.controller, False), (stored.drive, True)):
        for name in JointSet.__slots__:
            numbers: tuple[int, ...] = getattr(values, name)
            if len(numbers) != n:
                raise ValueError(f"{name} has {len(numbers)} values, not {n}")
            for joint, value in enumerate(numbers, 1):
                parameters = parameters.with_value(name, joint, value, is_drive=is_drive)
    if len(stored.zero) != n:
        raise ValueError(f"zero has {len(stored.zero)} values, not {n}")
    return replace(parameters, zero=stored.zero)
