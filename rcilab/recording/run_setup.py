"""Circumstances of a run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, as_vector, described
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Circumstances of a run; unknown fields are empty."""

    target: str = ""
    """"virtual", or the address of the controller."""
    plant: str = ""
    """Plant of a virtual controller: "ideal" or "mujoco"."""
    mode: str = ""
    """Control mode, such as "joint_position"."""
    commands: str = ""
    """What was commanded, such as "joint_velocity" or "cartesian_velocity", where a virtual controller recorded it."""
    started_ns: int = 0
    """Start of the run, nanoseconds since 1970 (UTC); 0: not known."""
    client: str = ""
    """Address of the program that commanded it, where a virtual controller recorded the run; "" for rcilab itself."""
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Settings of the controller in force, in SI units, where it recorded the run."""

    @property
    def motion_kind(self) -> str:
        """The mode, or what was commanded if that is not what the mode is named after, with the impedance."""
        usual = f"{self.mode.split('_')[0]}_position"
        if self.commands in ("", usual) or self.mode == "torque":
            return self.mode
        return f"{self.commands}-{self.mode}" if self.mode.endswith("impedance") else self.commands

    @property
    def started(self) -> str:
        """Start of the run, such as 2026-05-01T12:00:00Z; "" if it is not known."""
        return (
            time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(self.started_ns // 1_000_000_000))
            if self.started_ns
            else ""
        )

    @property
    def safety_box(self) -> SafetyBox | None:
        """The safety box of the controller, where it recorded the run."""
        box = self.settings.get("safety_box")
        if box is None:
            return None
        return SafetyBox(size=tuple(box["size"]), T_base_box=Pose.from_row_major(box["pose"]), active=box["active"])

    @property
    def joint_limits(self) -> Array | None:
        """Lower and upper bounds of the joint angles in the controller, where it recorded the run, shape (2, n), [rad].

        Raises:
            InvalidValueError: They are not numbers.
        """
        lower, upper = self.settings.get("joint_lower"), self.settings.get("joint_upper")
        if lower is None or upper is None:
            return None
        return np.stack([as_vector(bound, len(lower), "soft limits of the run", "rad") for bound in (lower, upper)])

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields as JSON data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Setup:
        """Returns the setup from the data of `as_dict`; fields of a later version are ignored.

        Raises:
            TypeError: A value has another type.
            LookupError: The safety box is not complete; also an InvalidValueError where it or a limit is not valid.
        """
        found = {item.name: values[item.name] for item in fields(cls) if item.name in values}
        for name, value in found.items():
            if not isinstance(value, {"started_ns": int, "settings": Mapping}.get(name, str)):
                raise TypeError(f"{name} in its setup is {described(value)}")
        setup = cls(**found)
        _ = setup.safety_box, setup.joint_limits
        return setup
