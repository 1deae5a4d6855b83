"""The client libraries of Franka's interface, each for one version of it, as the extra `franka` installs them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rcilab.core.errors import ModelError
from rcilab.core.optional_deps import require_library

_LIBRARIES = {5: ("panda_py.libfranka", "Panda"), 10: ("pylibfranka", "FR3")}
_PACKAGES = {5: "panda-python", 10: "pylibfranka"}
_NO_WHEEL = (3, 13)
"""First version of Python without a pylibfranka."""
_LARGEST_VERSION = 255
"""The controllers have had ten versions; two letters of another protocol are a larger number."""


def arm_of(version: int, address: object) -> str:
    """Returns the name of the arm whose controller has a version of the interface.

    Raises:
        ModelError: No arm of rcilab has this version.
    """
    if version > _LARGEST_VERSION:
        raise ModelError(f"what answers at {address} is not Franka's interface; check the address")
    if version not in _LIBRARIES:
        raise ModelError(
            f"the controller at {address} has version {version} of Franka's interface; rcilab drives "
            + " and ".join(f"version {known} ({arm})" for known, (_, arm) in _LIBRARIES.items())
        )
    return _LIBRARIES[version][1]


def version_of(arm: str) -> int:
    """Returns the version of the interface that an arm's controller has."""
    return next(version for version, (_, name) in _LIBRARIES.items() if name == arm)


def load_client_library(version: int) -> Any:
    """Returns the client library of a version.

    Raises:
        MissingExtraError: It is not installed; the message has the command that installs it.
    """
    name, arm = _LIBRARIES[version]
    purpose = f"driving the {arm}"
    if version == 10 and sys.version_info >= _NO_WHEEL:
        purpose += " (with Python 3.12 or older: later ones have no pylibfranka)"
    with kept_scheduling():
        return require_library(name, purpose, "franka", _PACKAGES[version])


@contextmanager
def kept_scheduling() -> Iterator[None]:
    """Restores the scheduling of this thread at the end: libfranka requests the highest priority for it."""
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        if (os.sched_getscheduler(0), os.sched_getparam(0)) != (policy, parameters):
            os.sched_setscheduler(0, policy, parameters)
